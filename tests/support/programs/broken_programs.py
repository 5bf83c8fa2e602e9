"""Programs made by a grammar of KRL, and then broken: for tests that a reader ends well, whatever it is given."""

from __future__ import annotations

import random
from pathlib import Path

NUMBERS = (
    *("0", "1", "-1", "90", "-89.99", "1e-3", "-3.42E-05", "1e400", "-1e400", "nan", "inf", "1e38", "9" * 45, "'B101'"),
    *("'HZZ'", "1.2.3", "", "I", "R", "2*3", "1/0", "-", "TRUE", "#BASE", '"x"', "{X 1}", "SIN(30)", "$IN[1]"),
)
FIELDS = ("X", "Y", "Z", "A", "B", "C", "E1", "E2", "E3", "S", "T", "A1", "A6", "A7", "FOO", "X")
BLENDS = ("", "", " C_DIS", " C_PTP", " C_VEL", " C_ORI", " C_FOO", " C_DIS C_DIS C_DIS", " #TOOL", ", CA 90")
SYSTEM = (
    "$TOOL",
    "$BASE",
    "$VEL.CP",
    "$VEL",
    "$APO.CDIS",
    "$ADVANCE",
    "$OUT[1]",
    "$VEL_AXIS[1]",
    "$ROBROOT",
    "$TOOL.X",
)
WORDS = (
    *("LIN", "PTP", "CIRC", "LIN_REL", "PTP_REL", "SLIN", "SPL", "SPTP", "CIRC_REL", "WAIT", "WAIT SEC", "IF", "THEN"),
    *("ELSE", "ENDIF", "FOR", "TO", "ENDFOR", "LOOP", "ENDLOOP", "EXIT", "END", "DEF", "ENDDAT", "SWITCH", "CASE"),
    *("DEFAULT", "DECL", "{", "}", "(", ")", "[", "]", ",", ":", ";", "=", "==", "&", '"', "'", "#", "$", "\t", "\\"),
    *("\0", "\x1b[2J", "é", "\u2028", "\ufeff", "T ( )", "U (1, I)", "GOTO X", "RETURN", "BAS", "EK(", "TRIGGER WHEN"),
)


def broken(rng: random.Random, folder: Path) -> Path:
    """Write a program of one to three files, most of them broken somewhere; the path of the main one."""
    lines = ["DEF T ( )", "DECL INT I", "DECL REAL R"]
    lines += ["I = 0", "R = 1"]
    lines += ["$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}", "$BASE=$NULLFRAME"] if rng.random() < 0.95 else []
    lines += ["LIN {X 1,Y 2,Z 3,A 4,B 5,C 6,E1 0,E2 0}"] if rng.random() < 0.8 else []
    lines += [line for _ in range(rng.randint(0, 12)) for line in statement(rng, 3)]
    lines += ["END", "DEF U (n:IN, m:OUT)", "INT n, m", *statement(rng, 2), "m=n+1", "END"]
    text = "\n".join(lines) + "\n"
    for _ in range(rng.choice((0, 0, 0, 1, 1, 2, 5))):
        text = mutated(rng, text)
    path = folder / "T.src"
    path.write_bytes(text.encode("utf-8", "replace"))
    if rng.random() < 0.3:
        data = f"DEFDAT T PUBLIC\nDECL FRAME F={point(rng)}\nDECL REAL Q[3]\nQ[2]={number(rng)}\nENDDAT\n"
        data = mutated(rng, data) if rng.random() < 0.5 else data
        (folder / "T.dat").write_bytes(data.encode("utf-8", "replace"))
    return path


def number(rng: random.Random) -> str:
    """A number, mostly a good one."""
    return f"{rng.uniform(-500, 500):.3f}" if rng.random() < 0.998 else rng.choice(NUMBERS)


def point(rng: random.Random) -> str:
    """A point or axes, mostly good ones."""
    chance = rng.random()
    if chance < 0.9:
        fields = ["X", "Y", "Z", "A", "B", "C", "E1", "E2"]
    elif chance < 0.95:
        fields = ["A1", "A2", "A3", "A4", "A5", "A6"]
    else:
        fields = rng.choices(FIELDS, k=rng.randint(0, 7))
    body = "{" + ",".join(f"{name} {number(rng)}" for name in fields) + "}"
    return (
        body if rng.random() < 0.97 else rng.choice(("F", "XHOME", "$POS_ACT", "$AXIS_ACT", f"{body}:{body}", "Q[2]"))
    )


def statement(rng: random.Random, depth: int) -> list[str]:
    """A statement, blocks with what they hold."""

    def inner() -> list[str]:
        return [line for _ in range(rng.randint(0, 3)) for line in statement(rng, depth - 1)] if depth else []

    chance = rng.random()
    if chance < 0.45:
        word = rng.choice(("LIN", "LIN", "LIN", "LIN", "PTP", "SLIN", "SPTP", "LIN_REL"))
        end = "{X 5,Y -2}" if word == "LIN_REL" and rng.random() < 0.9 else point(rng)
        return [f"{word} {end}{blend(rng)}"]
    if chance < 0.5:
        return [f"CIRC {point(rng)},{point(rng)}{blend(rng)}"]
    if chance < 0.65:
        good = (
            "$VEL.CP = 0.01",
            "$APO.CDIS = 2",
            "$ADVANCE = 3",
            "$OUT[1] = TRUE",
            "$VEL_AXIS[1] = 40",
            "$BASE=$NULLFRAME",
        )
        bad = f"{rng.choice(SYSTEM)} = {rng.choice((number(rng), point(rng)))}"
        return [rng.choice(good) if rng.random() < 0.9 else bad]
    if chance < 0.75:
        return [rng.choice(("WAIT SEC 0.1", "HALT", "U (1, I)", "ARC_ON ( )", ";process_off", "I = I + 1"))]
    if chance < 0.76:
        return [rng.choice(("T ( )", "EXIT", "RETURN", "I = $IN[1]", "NEXT ( )"))]
    return rng.choice(
        (
            [f"FOR I = 1 TO {rng.choice(('0', '3', '-2'))}", *inner(), "ENDFOR"],
            [f"IF {rng.choice(('TRUE', 'FALSE', 'I > 2', 'NOT (I == 1)'))} THEN", *inner(), "ELSE", *inner(), "ENDIF"],
            ["REPEAT", *inner(), "I = I + 1", "UNTIL I > 5"],
            ["WHILE I < 4", *inner(), "I = I + 1", "ENDWHILE"],
            ["LOOP", *inner(), "EXIT", "ENDLOOP"],
            ["SWITCH I", "CASE 1, 2", *inner(), "DEFAULT", *inner(), "ENDSWITCH"],
            ["SPLINE", f"SPL {point(rng)}", "ENDSPLINE"],
            ["INTERRUPT ON 3", "TRIGGER WHEN DISTANCE=1 DELAY=0 DO ARC_OFF( ) PRIO=-1"],
        )
    )


def blend(rng: random.Random) -> str:
    """What stands behind a motion."""
    return rng.choice(BLENDS[:3]) if rng.random() < 0.99 else rng.choice(BLENDS)


def mutated(rng: random.Random, text: str) -> str:
    """A text with one thing wrong."""
    place, end = sorted((rng.randint(0, len(text)), rng.randint(0, len(text))))
    lines = text.split("\n")
    row = rng.randrange(len(lines))
    choice = rng.randrange(7)
    if choice == 0:
        return text[:place]
    if choice == 1:
        return text[:place] + text[min(end, place + rng.randint(1, 12)) :]
    if choice == 2:
        return text[:place] + rng.choice(WORDS) * rng.choice((1, 1, 1, 3, 100, 3000)) + text[place:]
    if choice == 3:
        return "\n".join(lines[:row] + lines[row + 1 :])
    if choice == 4:
        return "\n".join(lines[: row + 1] + [lines[row]] * rng.choice((1, 50)) + lines[row + 1 :])
    if choice == 5:
        words = lines[row].split(" ")
        words[rng.randrange(len(words))] = rng.choice((*WORDS, *NUMBERS))
        return "\n".join([*lines[:row], " ".join(words), *lines[row + 1 :]])
    rng.shuffle(lines)
    return "\n".join(lines)
