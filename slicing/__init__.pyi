from .annotations import Meaning as Meaning

# what the package exports: read by editors, type checkers, and the package itself
from .beads.deposition import layer_metal as layer_metal
from .beads.deposition import metal_document as metal_document
from .beads.deposition import share_of as share_of
from .beads.lay import LaidSubVolume as LaidSubVolume
from .beads.lay import lay_beads as lay_beads
from .beads.overhang import ALLOWED as ALLOWED
from .beads.overhang import Overhang as Overhang
from .beads.overhang import overhangs as overhangs
from .beads.overhang import worst_angle as worst_angle
from .decomposition.body_hint import BodyHint as BodyHint
from .decomposition.cut import solid_of as solid_of
from .decomposition.decompose import decompose as decompose
from .decomposition.evidence_warnings import Evidence as Evidence
from .decomposition.evidence_warnings import frame_line as frame_line
from .deposits.part_shape import PartShape as PartShape
from .deposits.part_shape import beyond_borders as beyond_borders
from .deposits.part_shape import part_shape as part_shape
from .deposits.part_shape import solid_of_revolution as solid_of_revolution
from .document import slices_document as slices_document
from .document import targets_rows as targets_rows
from .layers.body_ends import NO_ENDS as NO_ENDS
from .layers.body_ends import body_ends as body_ends
from .layers.layer import SlicedSubVolume as SlicedSubVolume
from .mesh.hull import convex_hull as convex_hull
from .mesh.hull import hull_planes as hull_planes
from .mesh.load import load_mesh as load_mesh
from .mesh.load import read_triangles as read_triangles
from .mesh.load import solid_from_arrays as solid_from_arrays
from .mesh.solid import Bools as Bools
from .mesh.solid import Mesh as Mesh
from .mesh.solid import PartError as PartError
from .mesh.solid import low_part_warnings as low_part_warnings
from .paper.indices import Indices as Indices
from .paper.indices import indices as indices
from .paper.scores import ZERO_RAD as ZERO_RAD
from .paper.scores import Scores as Scores
from .paper.scores import scores_of as scores_of
from .parameters import UNITS_MM as UNITS_MM
from .parameters import BeadParameters as BeadParameters
from .parameters import LengthUnit as LengthUnit
from .parameters import SeamPlace as SeamPlace
from .parameters import SlicingParameters as SlicingParameters
from .parameters import Strategy as Strategy
from .strategies.printed_body import BODY_NAME as BODY_NAME
from .strategies.printed_body import slice_body as slice_body
from .strategies.printed_body import turned_solid as turned_solid
from .strategies.slice import slice_sub_volume as slice_sub_volume
from .surfaces.bodies import STRATEGIES as STRATEGIES
from .surfaces.bodies import Body as Body
from .surfaces.bodies import ConicalBody as ConicalBody
from .surfaces.bodies import CylindricalBody as CylindricalBody
from .surfaces.bodies import RevolvedBody as RevolvedBody
from .surfaces.bodies import fits as fits
from .targets.speeds import BeadSpeed as BeadSpeed
from .targets.targets import Targets as Targets
from .targets.targets import sample_beads as sample_beads
from .targets.waypoints import travels as travels
from .toolpaths.bead_hulls import bead_hulls as bead_hulls
from .toolpaths.csv_file import read_toolpath as read_toolpath
from .toolpaths.shortcuts import lay as lay
from .toolpaths.shortcuts import load as load
from .toolpaths.shortcuts import slice as slice
from .toolpaths.toolpath import Toolpath as Toolpath
from .toolpaths.toolpath import toolpath_shape as toolpath_shape
from .warning import WRONG_LAYER as WRONG_LAYER
from .warning import Code as Code
from .warning import Warning as Warning
from .warning import typed as typed

__all__ = [
    "ALLOWED",
    "BODY_NAME",
    "NO_ENDS",
    "STRATEGIES",
    "UNITS_MM",
    "WRONG_LAYER",
    "ZERO_RAD",
    "BeadParameters",
    "BeadSpeed",
    "Body",
    "BodyHint",
    "Bools",
    "Code",
    "ConicalBody",
    "CylindricalBody",
    "Evidence",
    "Indices",
    "LaidSubVolume",
    "LengthUnit",
    "Meaning",
    "Mesh",
    "Overhang",
    "PartError",
    "PartShape",
    "RevolvedBody",
    "Scores",
    "SeamPlace",
    "SlicedSubVolume",
    "SlicingParameters",
    "Strategy",
    "Targets",
    "Toolpath",
    "Warning",
    "bead_hulls",
    "beyond_borders",
    "body_ends",
    "convex_hull",
    "decompose",
    "fits",
    "frame_line",
    "hull_planes",
    "indices",
    "lay",
    "lay_beads",
    "layer_metal",
    "load",
    "load_mesh",
    "low_part_warnings",
    "metal_document",
    "overhangs",
    "part_shape",
    "read_toolpath",
    "read_triangles",
    "sample_beads",
    "scores_of",
    "share_of",
    "slice",
    "slice_body",
    "slice_sub_volume",
    "slices_document",
    "solid_from_arrays",
    "solid_of",
    "solid_of_revolution",
    "targets_rows",
    "toolpath_shape",
    "travels",
    "turned_solid",
    "typed",
    "worst_angle",
]
