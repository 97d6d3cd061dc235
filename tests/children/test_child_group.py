"""Families: what may be said for one, and what it is called."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripted_child import Scripted

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.children.child_group import ChildGroup, ChildSpec, side_by_side

PLAN = FloorPlan.parse("####\n#B.#\n####", "closet")


@pytest.mark.parametrize(
    ("said", "children"),
    [
        ("0.50", (ChildSpec(0.5),)),
        ("1,.25", (ChildSpec(1.0), ChildSpec(0.25))),
        (" 1 , adversary:.25 ", (ChildSpec(1.0), ChildSpec(0.25, "adversary"))),
        (ChildSpec(0.1, "expert"), (ChildSpec(0.1, "expert"),)),
        ([0.5, "1,0.25", ChildSpec(0.1)], (ChildSpec(0.5), ChildSpec(1.0), ChildSpec(0.25), ChildSpec(0.1))),
    ],
)
def test_what_may_be_said_for_a_family(said, children):
    family = ChildGroup.of(said)
    assert family.children == children
    assert len(family) == len(children)
    assert family.epsilon == pytest.approx(sum(child.epsilon for child in children) / len(children))


def test_a_behaviour_is_for_the_house_that_it_was_made_for():
    other = FloorPlan.parse("#####\n#B..#\n#####", "hall")
    with pytest.raises(CaregiverError, match=r"^Scripted must be made for house 'closet', got one for 'hall'$"):
        ChildGroup.of([1.0, Scripted(other)]).make(PLAN)
    like = FloorPlan.parse("####\n#B.#\n####", "wardrobe")
    assert ChildGroup.of(Scripted(like)).make(PLAN)


def test_an_object_is_one_child():
    child = Scripted(PLAN)
    for family in (ChildGroup.of([child, child]), ChildGroup.of(child).times(2)):
        with pytest.raises(CaregiverError, match="got the same Scripted twice: make one for each"):
            family.make(PLAN)
    with pytest.raises(CaregiverError, match="got the same Scripted twice"):
        side_by_side(PLAN, [ChildGroup.of(child), ChildGroup.of(child)], 3)
    assert ChildGroup.of([child, Scripted(PLAN), 0.5, 0.5]).make(PLAN)


def test_children_without_a_name_have_the_behaviour_that_is_given():
    family = ChildGroup.parse("1,novice:.5", behaviour="adversary")
    assert family.children == (ChildSpec(1.0, "adversary"), ChildSpec(0.5, "novice"))


@given(st.lists(st.tuples(st.floats(0, 1), st.sampled_from(["novice", "expert", "adversary"])), min_size=1, max_size=4))
def test_the_name_says_it_all(children):
    family = ChildGroup(tuple(ChildSpec(*child) for child in children))
    assert ChildGroup.parse(str(family)) == family
