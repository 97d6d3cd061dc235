"""Submissions in parts: what is in a file by the names of its members, to be changed and written again."""

import hashlib
import json
import zipfile

from caregiver_mj import cli


def run(*arguments):
    return cli.main([*map(str, arguments)])


def parts_of(path):
    with zipfile.ZipFile(path) as file:
        return {name: json.loads(file.read(name)) for name in file.namelist() if name != "sha256.json"}


def write(path, parts, sums=None):
    """Write a submission, with checksums that fit if none are given."""
    texts = {name: json.dumps(part) for name, part in parts.items()}
    sums = sums or {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, text in {**texts, "sha256.json": json.dumps(sums)}.items():
            file.writestr(name, text)
