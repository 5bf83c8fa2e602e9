"""What charts say of areas, turns and points of several curves."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from slicing.surfaces.charts import FlatChart, PoleChart, RoundChart
from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved

AXIS = (0.0, 0.0)
DOME = Revolved(AXIS, tuple((30 * math.sin(a), 30 * math.cos(a)) for a in np.linspace(0.5 * math.pi, 0.0, 91)))


def parallel(radius: float, z: float, low: float = -math.pi, high: float = math.pi) -> np.ndarray:
    angle = np.linspace(low, high, 200, endpoint=False)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(200, z)], axis=1)


def test_areas_in_a_chart_right_round_are_those_on_the_surface():
    cone = Cone(AXIS, 20.0, 30.0)
    for surface in (Cylinder(AXIS, 20.0), cone):
        chart = RoundChart.around(surface, [parallel(20.0, 0.0), parallel(20.0 + 4.0 * surface.slope, 4.0)], ring=True)
        low, high = (float(chart.flat(parallel(20.0 + z * surface.slope, z))[:, 1].mean()) for z in (1.0, 1.2))
        ring = shapely.box(-0.5 * chart.period, low, 0.5 * chart.period, high)
        exact = 2 * math.pi * (20.0 + 1.1 * surface.slope) * 0.2 * math.hypot(1.0, surface.slope)
        assert chart.area(ring) == pytest.approx(exact, rel=1e-3)
    assert ring.area > 1.05 * exact  # of the cone: in the chart it is as long as the widest parallel


def test_the_area_about_a_pole_is_that_of_the_cap():
    border = parallel(30 * math.sin(1.0), 30 * math.cos(1.0))
    chart = PoleChart.around(DOME, [border], side=1)
    region = chart.within(float(np.hypot(*chart.flat(border).T).mean()))
    assert chart.area(region) == pytest.approx(2 * math.pi * 30**2 * (1 - math.cos(1.0)), rel=2e-3)
    assert region.area > 1.05 * chart.area(region)
    assert chart.area(shapely.Polygon()) == 0.0
    flat = PoleChart.around(Revolved(AXIS, ((20.0, 0.0), (20.0, 9.0), (0.0, 9.0))), [parallel(7.0, 9.0)], side=1)
    assert flat.area(flat.within(7.0)) == pytest.approx(math.pi * 49, rel=1e-4)


def test_a_turn_moves_shapes_along_a_cylinder_and_turns_them_on_a_cone():
    loop = parallel(20.0, 0.0, -0.5, 0.5)
    chart = RoundChart.around(Cylinder(AXIS, 20.0), [loop], ring=False)
    assert chart.turn_mm == pytest.approx(2 * math.pi * 20.0)
    place = np.array([[3.0, 1.0]])
    assert chart.lift(place + np.array([[chart.turn_mm, 0.0]])) == pytest.approx(chart.lift(place))
    cone = RoundChart.around(
        Cone(AXIS, 20.0, 30.0), [loop, parallel(25.0, 5.0 * math.sqrt(3.0), -0.5, 0.5)], ring=False
    )
    pole = PoleChart.around(DOME, [parallel(10.0, 28.0)], side=1)
    assert [one.turn_mm for one in (cone, pole, FlatChart(Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))))] == [0.0] * 3


def test_points_of_several_curves_are_laid_flat_each_by_itself():
    ring = [parallel(20.0, 0.0), parallel(20.0, 4.0)]
    chart = RoundChart.around(Cylinder(AXIS, 20.0), ring, ring=True)
    flat = np.array([[-40.0, 1.0], [50.0, -1.0], [-55.0, 0.5], [0.0, 1.5]])  # jumps of more than half a turn
    assert chart.flat_each(chart.lift(flat)) == pytest.approx(flat)
    assert chart.flat(chart.lift(flat)) != pytest.approx(flat)
    for other in (FlatChart(Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))), PoleChart.around(DOME, ring, side=1)):
        points = other.lift(np.array([[3.0, 1.0], [-9.0, 2.0]]))
        assert np.array_equal(other.flat_each(points), other.flat(points))
