"""What cylindrical, conical and revolved bodies answer alike."""

from __future__ import annotations

import pytest

from slicing import ConicalBody, CylindricalBody, PartError, RevolvedBody

UPRIGHT = RevolvedBody(((20.0, 0.0), (20.0, 40.0)))
BODIES = [CylindricalBody(20.0, off_mm=0.3), ConicalBody(20.0, 10.0), UPRIGHT]


def test_only_a_cylinder_is_taken_for_a_cylinder():
    assert BODIES[0].as_cylinder() is BODIES[0]
    for other in BODIES[1:]:
        with pytest.raises(PartError, match="a cylinder is needed"):
            other.as_cylinder()


def test_the_real_surface_is_off_a_cylinder_that_stands_for_a_cone():
    assert [body.off_mm for body in BODIES] == [0.3, 0.0, 0.0]


def test_points_of_a_profile_are_rounded_by_a_share_of_its_radius():
    assert [body.rounding_mm for body in BODIES] == pytest.approx([0.0, 0.0, 1e-4])


def test_a_profile_alone_takes_its_end_faces():
    assert [body.takes_end_faces for body in BODIES] == [False, False, True]
    assert all(body.with_end_faces(True, True) is body for body in BODIES[:2])
    assert UPRIGHT.with_end_faces(False, False).profile_mm == UPRIGHT.profile_mm
    assert UPRIGHT.with_end_faces(True, False).profile_mm == ((0.0, 0.0), *UPRIGHT.profile_mm)
    assert UPRIGHT.with_end_faces(False, True).profile_mm == (*UPRIGHT.profile_mm, (0.0, 40.0))


def test_a_profile_that_is_closed_on_the_axis_goes_round_its_ends_whichever_way_it_is_written():
    assert [body.closes_ends for body in BODIES] == [(False, False)] * 3
    for low in (False, True):
        for high in (False, True):
            closed = UPRIGHT.with_end_faces(low, high)
            assert closed.closes_ends == (low, high)
            assert RevolvedBody(closed.profile_mm[::-1]).closes_ends == (low, high)
            assert closed.with_end_faces(low, high) == closed  # not a second time
