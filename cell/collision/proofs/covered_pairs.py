"""The arm's shapes against covers of what is laid: how far each is apart at least, and by which plane.

    pairs = covered_pairs(links, poses, clusters, near, need)      # near: pairs that were seen at the clusters' samples

A direction separates two shapes by the gap between their supports, wherever it comes from. Tried are those in which
pieces of what is laid were seen to be apart, and the way from the cover's middle to that of the shape. Metres.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ..near_pairs import NearPairs
from .carried_planes import pairs_below
from .link_poses import ArmLinks, LinkPoses, seen_from
from .step_clusters import StepClusters


def covered_pairs(
    links: ArmLinks, poses: LinkPoses, clusters: StepClusters, near: NearPairs, need: Floats
) -> NearPairs:
    """Pairs of a shape of the arm and a cover.

    Args:
        links: the arm, with the covers.
        poses: at the samples.
        clusters: of steps.
        near: pairs that were seen at the samples of the clusters that were checked.
        need: how far apart they have to be proved, (c,), m.

    Returns:
        Pairs with how far they are apart at least; every other is further apart than needed.
    """
    cluster, geom, cover, away = _maybe_near(links, poses, clusters, need)
    at, joint = clusters.at[cluster], links.owner[geom]
    axes, place = poses.axes_of(joint, at), poses.places_of(joint, at)
    best, normal = np.full(len(cluster), -np.inf), np.zeros((3, len(cluster)))
    for tried in (away, *_seen_normals(links, near, cluster, geom)):
        gap = np.einsum("xk,xk->k", tried, place) - links.reach(geom, -seen_from(axes, tried))
        gap -= links.reach(cover, tried)
        better = gap > best
        best[better], normal[:, better] = gap[better], tried[:, better]
    k = np.flatnonzero(best < need[cluster])
    towards = -normal[:, k].T @ links.T_world_base[:3, :3].T
    return NearPairs(cluster[k], np.stack([geom[k], cover[k]], axis=1), best[k], towards, np.full((len(k), 3), np.nan))


def _maybe_near(
    links: ArmLinks, poses: LinkPoses, clusters: StepClusters, need: Floats
) -> tuple[Ints, Ints, Ints, Floats]:
    """Cells, shapes and covers whose balls are no further apart than needed, (k,) each; the ways between, (3, k)."""
    geoms = links.meets_laid
    shapes = [links.shape(g) for g in geoms.tolist()]
    middle = np.array([s.middle for s in shapes]).reshape(-1, 3)
    size, joint = np.array([s.size for s in shapes]), links.owner[geoms]
    found: list[tuple[Ints, Ints, Ints, Floats]] = []
    for laid in np.unique(clusters.laid).tolist():
        mine = np.flatnonzero(clusters.laid == laid)
        axes, place = (each.take(clusters.at[mine], axis=-1)[..., joint, :] for each in (poses.axes, poses.place))
        centre = np.einsum("cxgk,gc->xgk", axes, middle) + place
        for cover in links.covers.ids(laid):
            shape = links.shape(cover)
            way = centre - shape.middle[:, None, None]
            far = np.sqrt(np.einsum("xgk,xgk->gk", way, way))
            of, g = np.nonzero((far - size[:, None] - shape.size < need[mine]).T)
            direction = way[:, g, of] / np.maximum(far[g, of], 1e-12)
            found.append((mine[of], geoms[g], np.full(len(of), cover), direction))
    if not found:
        none = np.zeros(0, dtype=np.int64)
        return none, none, none, np.zeros((3, 0))
    cluster, geom, which, directions = (np.concatenate(each, axis=-1) for each in zip(*found, strict=True))
    return cluster, geom, which, directions


def _seen_normals(links: ArmLinks, near: NearPairs, cluster: Ints, geom: Ints) -> list[Floats]:
    """Directions (3, k) in which what is near was seen to be apart: the shape's own, and the cluster's; base frame."""
    still = np.flatnonzero((links.owner[near.geom] < 0).any(axis=1))
    pairs = pairs_below(links, near, still[np.argsort(near.distance[still], kind="stable")])
    many, out = len(links.owner), []
    for key, wanted in ((pairs.cluster * many + pairs.geom, cluster * many + geom), (pairs.cluster, cluster)):
        each, first = np.unique(key, return_index=True)
        tried = np.tile(np.array([[0.0], [0.0], [1.0]]), (1, len(wanted)))
        if len(each):
            at = np.minimum(np.searchsorted(each, wanted), len(each) - 1)
            known = each[at] == wanted
            tried[:, known] = pairs.normal[first[at[known]]].T
        out.append(tried)
    return out
