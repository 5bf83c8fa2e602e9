"""A TCP is where the wire ends; what is welded elsewhere is not what was checked."""

import pytest
from support.cells.cell_models import TORCH, write_case

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from slicing.warning import Code

SITE = '<site name="tcp" pos="0 0 0.357"/>'
WIRE = '<geom name="wire" type="cylinder" size="0.0006 0.0065" pos="0 0 0.3505"/>'
SHAPES = {
    "cylinder": WIRE,
    "capsule": '<geom name="wire" type="capsule" size="0.0006" fromto="0 0 0.344 0 0 0.3564"/>',
    "box": '<geom name="wire" type="box" size="0.0006 0.0006 0.0065" pos="0 0 0.3505"/>',
    "lying cylinder": '<geom name="wire" type="box" size="0.0065 0.0006 0.0006" pos="0 0 0.3505" euler="0 90 0"/>',
}


def said(folder, wire, place, names=("wire",)):
    """What is told of the wire with the TCP at a place."""
    assert SITE in TORCH
    assert WIRE in TORCH
    torch = TORCH.replace(SITE, f'<site name="tcp" pos="{place}"/>').replace(WIRE, wire)
    job = prepare(load_case(write_case(folder, "cell", torch=torch, tool={"wire": list(names)})))
    return [str(line) for line in job.warnings if getattr(line, "code", None) is Code.WIRE_SHAPE]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_tcp_beside_the_wire_is_refused(tmp_path, shape):
    assert said(tmp_path, SHAPES[shape], "0.001 0 0.357") == []
    with pytest.raises(InputError, match=r"site tcp is 3\.0 mm beside the end of the wire \(wire\)"):
        said(tmp_path, SHAPES[shape], "0 -0.003 0.357")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(
    ("place", "words"),
    [("0.360", "ends 3.0 mm before site tcp"), ("0.354", "goes on 3.0 mm ahead of site tcp"), ("0.3585", None)],
)
def test_a_wire_that_does_not_end_at_the_tcp_is_told(tmp_path, shape, place, words):
    lines = said(tmp_path, SHAPES[shape], f"0 0 {place}")
    assert len(lines) == (words is not None)
    assert words is None or words in lines[0]


def test_a_tcp_at_the_nozzle_is_refused(tmp_path):
    with pytest.raises(InputError, match="the site must be at the wire's end"):
        said(tmp_path, WIRE, "0 0 0.344")


@pytest.mark.parametrize(
    ("place", "off"), [("0 0.0015 0.357", None), ("0 0.003 0.357", "3.0"), ("0.008 0 0.357", "4.0")]
)
def test_a_tcp_between_two_wires_is_between_their_ends(tmp_path, place, off):
    two = "".join(
        WIRE.replace('"wire"', f'"wire_{k}"').replace("0 0 0.3505", f"{x} 0 0.3505")
        for k, x in enumerate((-0.004, 0.004))
    )
    if off is None:
        assert said(tmp_path, two, place, ("wire_0", "wire_1")) == []
        return
    with pytest.raises(InputError, match=rf"{off} mm beside the end of the wire \(wire_0, wire_1\)"):
        said(tmp_path, two, place, ("wire_0", "wire_1"))
