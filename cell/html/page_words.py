"""What the page says in words: verdict, facts, warnings and settings, as escaped HTML.

    words = PageWords(result)
    words.verdict(), words.facts(), words.warnings(), words.settings()

Everything that comes from a case (names, file names) is escaped here. Millimetres and degrees.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..printable import counted
from ..report.check_document import streamed_report
from ..report.remedy_lines import whom_it_helps
from ..units import METRES_PER_MM
from ..verdict.failure_words import failure_in_words
from ..verdict.result import NOT_LOOKED_AT, Result, TargetVerdict
from ..verdict.severity import GRAVEST_FIRST, worst_first
from ..verdict.table_use import table_use
from ..verdict.words import in_words, speed_in_words
from ..view.shown_motion import ShownMotion

if TYPE_CHECKING:
    from ..remedy_search.search import Remedy

REASON_WORDS = {
    "unreachable": "out of the arm's reach",
    "joint_limit": "over a joint limit",
    "singular": "too near a singularity",
    "collision": "colliding or too near",
    "no_path": "without a way to them",
    "speed": "slower than allowed: an axis cannot keep up",
    "gravity": "too far off upright",
    "overhang": "overhanging too far",
    # of a motion or a program from outside
    "off_bead": "off their bead",
    "order": "out of their order",
    "not_welded": "not welded",
    "tool": "with another tool",
    "base": "in a base that stands still",
    "external": "with an axis that is not given",
    "blend": "with corners rounded too far",
    "arc": "with the arc on or off in the wrong place",
    NOT_LOOKED_AT: "not checked",
}
VERDICTS = (*GRAVEST_FIRST, *(reason for reason in REASON_WORDS if reason not in GRAVEST_FIRST))


class PageWords:
    """The words on a result."""

    def __init__(self, result: Result, remedies: Sequence[Remedy] = ()) -> None:
        """Collect the figures.

        Args:
            result: the verdict.
            remedies: what would help, from ``cell.remedy_search.search``.
        """
        self.result, self.remedies = result, remedies
        self.document = {k: v for k, v in streamed_report(result).items() if k != "rows"}

    def title(self) -> str:
        """The case's name."""
        return escape(self.result.job.case.title)

    def verdict(self) -> str:
        """One sentence."""
        n, bad, motion = len(self.result.rows), self.result.infeasible, self.result.motion
        if isinstance(self.result, ShownMotion):
            return escape(_of_played(self.result))
        if motion is not None:
            return (
                f"The arm can weld all {n} targets in one motion, which was checked all along: "
                f"{_duration(float(motion.t_s[-1]))}, {_duration(motion.arc_time)} of it with the arc on."
            )
        counts = [f"{k} {REASON_WORDS[r]}" for r, k in self._counts()]
        looked = self.result.looked_at
        if looked == n:
            return f"{bad} of {n} targets cannot be welded at this table pose: {_joined(counts)}."
        return (
            f"{bad} of the {looked} targets that were checked cannot be welded at this table pose: "
            f"{_joined(counts)}. "
            f"{n - looked} of the part's {n} targets were not checked."
        )

    def worst(self) -> str:
        """The gravest infeasible target, with a link to it; empty where there is none."""
        i = worst(self.result)
        if i is None:
            return ""
        t, row = self.result.job.targets, self.result.rows[i]
        where = f"{t.sub_volume[t.sub_volume_index[i]]}, layer {t.layer[i]}"
        return f"The worst: {_jump(i)} ({escape(where)}): {escape(what_went_wrong(self.result, row))}."

    def _counts(self) -> list[tuple[str, int]]:
        count = Counter(row.reason for row in self.result.rows if row.failure is not None)
        return [(r, count[r]) for r in VERDICTS if count[r]]

    def reasons(self) -> str:
        """A button for every reason that occurs; it filters the table."""
        return "".join(
            f'<button type="button" class="chip" data-reason="{r}" aria-pressed="false">'
            f'<i class="dot" data-verdict="{r}"></i>{escape(r.replace("_", " "))} <b>{k}</b></button>'
            for r, k in self._counts()
        )

    def facts(self) -> str:
        """Table of what was found."""
        return "".join(f"<div><dt>{escape(name)}</dt><dd>{value}</dd></div>" for name, value in self._facts())

    def _facts(self) -> Iterator[tuple[str, str]]:
        job, d, n = self.result.job, self.document, len(self.result.rows)
        yield "Table pose", self._pose()
        looked = self.result.looked_at
        of = counted(n, "target") if looked == n else f"the {looked} targets checked ({n - looked} were not)"
        name = "Targets without a fault" if isinstance(self.result, ShownMotion) else "Weldable"
        yield name, f"{looked - self.result.infeasible} of {of}"
        layers = sum(job.layers)
        beads = int(job.targets.bead.max()) + 1
        sizes = (len(job.layers), "sub-volume"), (layers, "layer"), (beads, "bead")
        made = f"sliced {escape(job.case.slicing.strategy)}" if job.sliced else "of a toolpath"
        yield "Part", ", ".join([*(counted(*one) for one in sizes), made])
        if self.result.motion is not None:
            motion = d["motion"]
            waits = f", waiting {_duration(motion['dwell_s'])}" if motion["dwell_s"] else ""
            travels = f", travelling {_duration(motion['travel_s'])}"
            yield "Cycle time", f"{_duration(motion['time_s'])}, arc on {_duration(motion['arc_on_s'])}{travels}{waits}"
            if motion["speed"] is not None:
                yield "Deposition speed", self._speed(motion["speed"])
        yield "Least clearance", self._clearance(d["least_clearance"])
        if d["least_singularity_margin"] is not None:
            s = d["least_singularity_margin"]
            sigma = d["smallest_singular_value"]
            extra = "" if sigma is None else f"; smallest singular value {sigma:.3f}"
            kind, unit = escape(s["kind"]), "" if s["unit"] == "1" else f" {escape(s['unit'])}"
            yield "Singularity margin", f"{kind} {s['margin']:.4g}{unit}, at {_jump(s['target'])}{extra}"
        g = d["gravity_deg"]
        yield "Deposition direction", f"{g['min']:.0f}° to {g['max']:.0f}° off upright"
        if d["metal"] is not None:
            m = d["metal"]
            yield (
                "Metal",
                f"{m['mass_g']:.0f} g, {m['wire_m']:.1f} m of wire, {100 * m['share']:.0f} % of what the layers need",
            )
        yield "Roll about the wire", _roll(d["roll"])

    def _pose(self) -> str:
        if self.result.poses:
            poses = "; ".join(
                f"{escape(p.sub_volume)} {p.layers[0]} to {p.layers[1]} at {_angle(p.E1_deg)}, {_angle(p.E2_deg)}"
                for p in self.result.poses
            )
            return f"{self.result.mode} (layers at E1, E2): {poses}"
        if self.result.mode == "coordinated":
            use = table_use(self.result)
            axes = self.result.job.case.table.axes or ("E1", "E2")
            along = f"{' and '.join(axes)} move{'s' * (len(axes) == 1)} along the beads"
            return f"{along}: {escape(use.in_words())}" if use is not None else along
        asked, stands = self.result.asked, np.rad2deg(self.result.table)
        turned = "" if abs(stands[1] - asked[1]) < 1e-6 else f" (the axis stands at {_angle(stands[1])})"
        return f"E1 = {_angle(asked[0])}, E2 = {_angle(asked[1])}{turned}"

    def _speed(self, held: dict[str, Any]) -> str:
        words, i = escape(speed_in_words(held)), held["from_target"]
        # the number is the same in words and as a link
        return words.replace(f"least from target {i}", f"least from {_jump(i)}") if held["slowed"] else words

    def _clearance(self, least: dict[str, Any] | None) -> str:
        limit = self.result.job.case.checks.clearance_mm
        if isinstance(self.result, ShownMotion) and self.result.found.clearance is not None:
            distance, _, names = self.result.found.clearance
            between = " and ".join(escape(in_plain_words(self.result, name)) for name in names)
            return f"{distance / METRES_PER_MM:.1f} mm between {between}; {limit:g} mm needed"
        if least is None:
            nothing = self.result.clearance is None and self.result.motion is None
            return "not known: no stretch of a bead was found" if nothing else "nothing nearer than 50 mm"
        pair = " and ".join(escape(in_plain_words(self.result, name)) for name in least["pair"])
        raw = escape(" - ".join(least["pair"]), quote=True)
        of = " (on the parts of the motion that were found)" if self.result.motion is None else ""
        return (
            f'{least["distance_mm"]:.1f} mm between <span title="{raw}">{pair}</span>, '
            f"at {_jump(least['target'], least=True)}; {limit:g} mm needed{of}"
        )

    def warnings(self) -> str:
        """Items of a list; empty where there are none."""
        return "".join(f"<li>{escape(line)}</li>" for line in self.document["warnings"])

    def help(self) -> str:
        """Items of a list of what would help; empty where nothing was searched."""
        said = []
        for remedy in self.remedies:
            whose = whom_it_helps(self.result, remedy)
            of = f"for {escape(whose)}: " if whose else ""
            said.append(f"<li>{of}{escape(remedy.sentence.replace('->', '→'))}</li>")
        return "".join(said)

    def settings(self) -> str:
        """The settings that the verdict hangs on."""
        return "".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in self._settings())

    def _settings(self) -> Iterator[tuple[str, str]]:
        c = self.result.job.case
        s, k, p = c.slicing, c.checks, c.process
        yield "Layer height", f"{s.h_layer_mm:g} mm ({s.h_min_mm:g} to {s.h_max_mm:g} mm)"
        yield "Sampling", f"chords {c.sampling.chord_tolerance_mm:g} mm, segments from {c.sampling.min_segment_mm:g} mm"
        yield "Clearance needed", f"{k.clearance_mm:g} mm"
        if self.result.job.solver.geometry is not None:
            margins = f"wrist {k.wrist_deg:g}°, elbow {k.elbow_deg:g}°, shoulder {k.shoulder_mm:g} mm"
        else:
            margins = f"smallest singular value {k.sigma:g}"
        yield "Singularity margins needed", margins
        out = "half a bead, only a warning" if k.overhang_mm is None else f"at most {k.overhang_mm:g} mm"
        yield "Overhang", out
        yield "Off upright", "not limited" if k.gravity_max_deg is None else f"at most {k.gravity_max_deg:g}°"
        yield (
            "Speeds",
            f"deposition {p.deposition_speed_mm_s:g} mm/s, leaving and approaching a bead {p.travel_speed_mm_s:g} mm/s",
        )
        yield "Retract", f"{p.retract_mm:g} mm"
        yield "Arm, torch, table", f"{c.robot.model}, {c.tool.model}, {c.positioner.model}"
        x, y, z = c.positioner.position_mm
        yield "Positioner stands at", f"{x:g}, {y:g}, {z:g} mm"
        tcp = self.document["tcp_in_flange"]["xyz_mm"]
        yield "TCP in the flange frame", ", ".join(f"{v:.1f}" for v in tcp) + " mm"
        yield "Solver", str(self.document["solver"])


def _of_played(result: ShownMotion) -> str:
    """A motion or a program from outside in a sentence."""
    assert result.motion is not None
    name = "The motion" if result.program is None else f"The program {result.program.program.name}"
    how = "checked in the cell" if result.program is None else "run as the controller would and checked in the cell"
    times = f"{_duration(float(result.motion.t_s[-1]))}, {_duration(result.motion.arc_time)} of it with the arc on"
    took = f"{name} was {how}: {times}."
    if not result.findings:
        return f"{took} No faults."
    first, others = result.findings[0], Counter(one.reason for one in result.findings[1:])
    line = getattr(first, "line", None)
    where = f"row {first.row}" if line is None else f"{line}"
    found = f"{took} Found at {where}: {failure_in_words(first.failure)}"
    if not others:
        return f"{found}."
    each = _joined([f"{count} {reason.replace('_', ' ')}" for reason, count in others.items()])
    return f"{found}, and {others.total()} more: {each}."


def in_plain_words(result: Result, geom: str) -> str:
    """A geom's name in words: a deposit by its layer."""
    words = geom.split("/")
    names = result.job.targets.sub_volume
    if words[0] == "deposit" and len(words) > 2 and words[1].isdigit() and words[2] in names:
        layers = result.job.deposits[names.index(words[2])].tolist()
        return f"layer {layers.index(int(words[1]))} of {words[2]}"
    if words[0] == "built" and len(words) > 2:
        return f"{words[1]}, built before,"
    return geom.replace("_", " ")


def what_went_wrong(result: Result, row: TargetVerdict) -> str:
    """An infeasible target's reason and measure, with geoms in words."""
    pair = row.pair
    plain = " and ".join(in_plain_words(result, name) for name in pair) + ":"
    return in_words(row).replace(" - ".join(pair), plain) if pair else in_words(row)


def worst(result: Result) -> int | None:
    """The gravest infeasible target: the reason that is hardest to mend, then the largest measure."""
    return next(iter(worst_first(result)), None)


def _jump(target: int, least: bool = False) -> str:
    extra = " data-least" if least else ""
    return f'<button type="button" class="jump" data-target="{target}"{extra}>target {target}</button>'


def _angle(deg: float) -> str:
    return f"{deg:g}°".replace("-", "\u2212")


def _joined(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f}\u00a0s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    words = f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
    return words.replace(" ", "\u00a0")


def _roll(text: str) -> str:
    kind, *angles = text.split(":")
    if kind == "fixed":
        return f"fixed at {_angle(float(angles[0]))}"
    return "free" if kind == "free" else f"{_angle(float(angles[0]))} to {_angle(float(angles[1]))}"
