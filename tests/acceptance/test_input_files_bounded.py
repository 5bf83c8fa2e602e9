"""Files that would fill the memory, or that other programs write another way, are refused in one line."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from cell.errors import InputError
from cell.motion.motion_file import MOST_BYTES, _csv, _npz
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import PartError

NAMES = "t_s,A1_deg,E1_deg,arc"
CSV = [
    (NAMES.replace(",", ";") + "\n0,5;1,2;0;0\n", "separated by semicolons"),
    (NAMES.replace(",", "\t") + "\n0.5\t1.2\t0\t0\n", "separated by tabs"),
    (NAMES.replace(",", " ") + "\n0.5 1.2 0 0\n", "separated by spaces"),
    ("0.0,0.0,1.0,0\n0.1,0.0,1.0,0\n", "no line of column names"),
    ("# made by hand\n" + NAMES + "\n0,0,0,0\n", "line 1 is a comment"),
    (NAMES + "\n0,0,0,0\n# half\n1,0,0,0\n", "line 3 is a comment"),
    (NAMES + "\n0,5,1,2,0,0\n", "a decimal comma"),
    ("t_s,t_s\n0,0\n", "has the column t_s twice"),
]


@pytest.mark.parametrize(("text", "says"), CSV, ids=[says for _, says in CSV])
def test_a_motion_of_another_locale_says_what_is_expected(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        _csv(path, MOST_BYTES)
    assert says in str(caught.value)
    assert "twice" in says or "a comma between columns, a decimal point in numbers" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("version", [1, 2])
def test_an_array_that_says_it_is_larger_than_it_is(version: int, tmp_path: Path) -> None:
    path = tmp_path / "m.npz"
    head = io.BytesIO()
    described = {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
    write = np.lib.format.write_array_header_1_0 if version == 1 else np.lib.format.write_array_header_2_0
    write(head, described)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("t_s.npy", head.getvalue() + bytes(16))
    with pytest.raises(InputError, match=r"claims \(1000000000000,\) values but holds 16 bytes"):
        _npz(path, MOST_BYTES)


def bomb(path: Path) -> None:
    """An archive that says that its member is 3 GiB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", " " * 1000)
    raw = bytearray(path.read_bytes())
    struct.pack_into("<I", raw, raw.index(b"PK\x01\x02") + 24, 3 * 2**30)
    path.write_bytes(raw)


def endless(path: Path) -> None:
    """A GLB of ten thousand million vertices that are nowhere."""
    described = {"asset": {"version": "2.0"}, "accessors": [{"componentType": 5126, "count": 10**10, "type": "VEC3"}]}
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)


@pytest.mark.parametrize(
    ("name", "make", "says"), [("a.3mf", bomb, "unpacks to 3072 MiB"), ("a.glb", endless, "array")]
)
def test_a_mesh_that_unpacks_to_more_than_any_part_is_refused(name, make, says, tmp_path: Path) -> None:
    make(tmp_path / name)
    with pytest.raises(PartError, match=says) as caught:
        load_mesh(tmp_path / name)
    assert "\n" not in str(caught.value)
