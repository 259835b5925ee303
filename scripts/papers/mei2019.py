"""Mei et al. 2019: a tanker and a linear SVR as a model of KVLCC2 (RM-SVM).

Two target ships. MARIN's zigzags of 2007, which the paper learns from, are no part of
this project: their rows are run where the files lie beside the checkout. The MMG model
of KVLCC2 stands in for the ship elsewhere, and tells what the paper could not know: the
turns that a perfect model makes. The paper does not print the weight C of the errors;
it is 1 here, on standardised samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from identification.models.similarity import correlations, select_reference
from papers.mei2019_targets import (
    SHOWN,
    TANKER,
    Target,
    acceleration_correlations,
    heading_correlation,
    measured,
    off,
    our_way,
    papers_way,
    same_hull,
    taught_the_turns,
    usual_way,
    virtual,
)
from papers.row import Conclusion, Paper, Row
from shipgym.models import ShipModel, load_model

Pair = tuple[float | None, float | None]  # their way, at best

#: Table 4: block coefficient, L/B, B/T, L/V0 in s, rudder area by L T; the correlation
#: printed with it.
TABLE_4 = {
    "Mariner": ((0.60, 6.95, 3.10, 20.9, 1 / 83.1), -0.5758),
    "Tanker": ((0.83, 6.39, 2.58, 37.0, 1 / 61.0), 0.8510),
    "SR108": ((0.56, 6.89, 2.99, 14.1, 1 / 45.8), -0.8873),
    "PCC": ((0.55, 5.60, 3.93, 18.0, 1 / 39.8), -0.7228),
}
KVLCC2 = (0.90, 5.52, 2.79, 40.1, 1 / 48.7)
SHIPPED = {
    "Mariner": "mariner",
    "Tanker": TANKER,
    "SR108": "container",
}  # those of Table 4 that are here
ROUNDING = 0.02  # what rounding of Table 4 may change of a correlation

HARD = 35.0  # rudder of the turns, degrees
#: Measured by MARIN: overshoots of the 20/20, advance and tactical diameter at +35
#: degrees. The paper prints those of +35 once more as measured at -35.
MEASURED = {"overshoot_1": 13.8, "overshoot_2": 14.9, "advance": 3.25, "tactical": 3.34}
PRINTED = {"overshoot_1": 11.8, "overshoot_2": 14.3, "advance": 3.22, "tactical": 3.20}
PRINTED_PORT = {"advance": 3.26, "tactical": 3.24}
#: "EFD-NMRI" of Tables 6 and 7, which cites the authors of the MMG model that is the
#: target here.
NMRI = {
    HARD: {"advance": 3.31, "tactical": 3.36},
    -HARD: {"advance": 3.26, "tactical": 3.26},
}
WORDS = {"advance": "advance", "tactical": "tactical diameter"}
WITHIN = 1.0  # aim for the virtual ship, %
WITHIN_MEASURED = {
    "advance": 1.0,
    "tactical": 4.0,
}  # what the paper reaches at +35, rounded, %

BARE = "bare reference"
EACH = "weight by each trial held out"
VIRTUAL = "Tables 6, 7: MMG model as target"
NO_DATA = "data not at hand: MARIN's zigzags are no part of this project"
VIRTUAL_TANKER = f"{VIRTUAL}, by the tanker at best"


def rows() -> Iterator[Row]:
    """All rows."""
    yield from selection_rows()
    yield from virtual_rows()
    yield from tanker_rows()
    target = measured()
    yield from figure_rows(target)
    yield from overshoot_rows(target)
    yield from turn_rows(target)


def selection_rows() -> Iterator[Row]:
    """Table 4: which ship is most like KVLCC2."""
    found = correlations(
        KVLCC2, {name: features for name, (features, _) in TABLE_4.items()}
    )
    target = load_model("kvlcc2").particulars
    _, ours = select_reference(target, candidates=tuple(SHIPPED.values()))
    for name, (_, printed) in TABLE_4.items():
        yield Row(
            "Table 4",
            f"correlation of {name} with KVLCC2",
            printed,
            found[name],
            ours.get(SHIPPED.get(name, "")),
            f"their way within {ROUNDING:g}",
            abs(found[name] - printed) < ROUNDING,
            (
                "the table is rounded; at best: the ships that are here, with sqrt(g"
                " L)/V0 in place of L/V0"
                if name in SHIPPED
                else "the table is rounded; this ship is not here"
            ),
        )
    chosen = [
        max(found, key=lambda name: found[name]),
        max(ours, key=lambda name: ours[name]),
    ]
    yield Row(
        "Table 4",
        "the tanker is chosen (1: yes)",
        1.0,
        float(chosen[0] == "Tanker"),
        float(chosen[1] == TANKER),
        "yes",
        chosen == ["Tanker", TANKER],
    )


def virtual_rows() -> Iterator[Row]:
    """The MMG model as target: errors of the turns and of figures 8 and 9."""
    target, hull = virtual(), same_hull()
    fits = (papers_way(target).model, our_way(target, hull).model)
    bare = (target.bare(TANKER), target.bare(hull))
    for rudder in (HARD, -HARD):
        truth = target.turn_indices(target.ship, rudder)
        for index, words in WORDS.items():
            yield Row(
                VIRTUAL,
                f"{rudder:+.0f} deg: {words} of the target, L",
                NMRI[rudder][index],
                None,
                truth[index],
                note=(
                    "printed as EFD-NMRI, by the authors of this model; measured or"
                    " computed"
                ),
            )
        for models, kind in ((bare, BARE), (fits, "")):
            found = [target.turn_indices(model, rudder) for model in models]
            for index, words in WORDS.items():
                errors = _pair(
                    _error(indices[index], truth[index]) for indices in found
                )
                yield _virtual_row(
                    rudder, index, f"{words}{kind and ', ' + kind}", errors, kind == ""
                )
        turn = target.turn(target.ship, rudder)
        assert turn is not None
        runs = [target.turn(model, rudder) for model in fits]
        for channel in ("u", "v", "r"):
            yield Row(
                f"Figure {8 if rudder > 0.0 else 9}: MMG model as target",
                f"{rudder:+.0f} deg, {channel}: rms error, % of span",
                None,
                *_pair(off(run, turn, channel) for run in runs),
                note="the paper shows a picture",
            )


def _virtual_row(
    rudder: float, index: str, words: str, errors: Pair, aimed: bool
) -> Row:
    printed = (
        100.0 * (PRINTED[index] / MEASURED[index] - 1.0)
        if aimed and rudder > 0.0
        else None
    )
    return Row(
        VIRTUAL,
        f"{rudder:+.0f} deg: {words}, error, %",
        printed,
        *errors,
        f"within {WITHIN:g}" if aimed else "",
        _within(errors[1], WITHIN) if aimed else None,
        "as the paper: reference tanker; at best: the same hull at full scale",
    )


def tanker_rows() -> Iterator[Row]:
    """The tanker's least error: the same terms, fitted to the turns themselves."""
    target = virtual()
    ours, hindsight = our_way(target, TANKER).model, taught_the_turns(HARD)
    for rudder in (HARD, -HARD):
        truth, mine, taught = (
            target.turn_indices(m, rudder) for m in (target.ship, ours, hindsight)
        )
        for index, words in WORDS.items():
            error, limit = (
                _error(found[index], truth[index]) for found in (mine, taught)
            )
            met = _within(error, WITHIN)
            yield Row(
                VIRTUAL_TANKER,
                f"{rudder:+.0f} deg: {words}, error, %",
                None,
                None,
                error,
                f"within {WITHIN:g}",
                met,
                (
                    ""
                    if met or limit is None
                    else (
                        "the limit is the form, not the zigzags: tanker and linear"
                        " terms, by least squares of the zigzags and of these turns"
                        f" themselves, are off by {limit:+.1f} %"
                    )
                ),
            )


def figure_rows(target: Target | None) -> Iterator[Row]:
    """Figures 5 (reference and target), 6 (pattern search) and 7 (20/20 zigzag)."""
    pairs = _figure_pairs(target)
    for q, word, printed in (
        ("u", "surge", 0.99),
        ("v", "sway", 0.94),
        ("r", "yaw", 0.87),
    ):
        yield _measured_row(
            "Figure 5",
            f"correlation of {word} accelerations, reference and target",
            printed,
            pairs.get(f"acceleration {q}", ()),
            note=(
                "at best: with the correction; means over a window of samples, not"
                " filtered derivatives"
            ),
        )
    for q, word, printed in (
        ("u", "surge", 0.005),
        ("v", "sway", 1.0),
        ("r", "yaw", 1.0),
    ):
        yield _measured_row(
            "Figure 6",
            f"insensitive band of {word}",
            printed,
            pairs.get(f"band {q}", ()),
            note="the best bands depend on C, which is not printed",
        )
    yield _measured_row(
        "Figure 6",
        "correlation of headings, 20/20 zigzag",
        0.993,
        pairs.get("heading", ()),
        note="open loop from the measured rudder",
    )
    for channel in ("u", "v", "r", "psi"):
        yield _measured_row(
            "Figure 7",
            f"20/20 zigzag, {channel}: rms error, % of span",
            None,
            pairs.get(f"off {channel}", ()),
            note="the paper shows a picture; open loop from the measured rudder",
        )


def _figure_pairs(target: Target | None) -> dict[str, Pair]:
    """Errors their way and at best, by quantity; empty where the data is missing."""
    if target is None:
        return {}
    fits = (papers_way(target), our_way(target, TANKER))
    models = (target.bare(TANKER), fits[1].model)
    accelerations = [acceleration_correlations(target, model) for model in models]
    searches = [(fit.model.provenance or {})["search"] for fit in fits]
    pairs: dict[str, Pair] = {
        "heading": _pair(heading_correlation(target, fit) for fit in fits)
    }
    for q in ("u", "v", "r"):
        pairs[f"acceleration {q}"] = _pair(found[q] for found in accelerations)
        pairs[f"band {q}"] = _pair(search[q]["epsilon"] for search in searches)
    for channel in ("u", "v", "r", "psi"):
        truth = target.trial(SHOWN)
        pairs[f"off {channel}"] = _pair(
            off(fit.predictions[SHOWN], truth, channel) for fit in fits
        )
    return pairs


def overshoot_rows(target: Target | None) -> Iterator[Row]:
    """Table 5: the 20/20 zigzag, steered by the model's own heading."""
    for kind, models in _measured_models(target).items():
        found = [target.overshoots(model) for model in models] if target else []
        for index, word in (("overshoot_1", "1st"), ("overshoot_2", "2nd")):
            yield _measured_row(
                "Table 5",
                f"20/20: {word} overshoot, deg{kind and ', ' + kind}",
                PRINTED[index] if kind == "" else None,
                [values[index] for values in found],
                aim=(
                    (MEASURED[index], abs(PRINTED[index] - MEASURED[index]))
                    if kind == ""
                    else None
                ),
                words=f"nearer to {MEASURED[index]:g} than printed",
            )


def turn_rows(target: Target | None) -> Iterator[Row]:
    """Tables 6 and 7: the turns, which no zigzag shows."""
    models = _measured_models(target)
    models[EACH] = [] if target is None else [usual_way(target, TANKER).model]
    for rudder, printed in ((HARD, PRINTED), (-HARD, PRINTED_PORT)):
        for kind, compared in models.items():
            found = (
                [target.turn_indices(model, rudder) for model in compared]
                if target
                else []
            )
            for index, words in WORDS.items():
                aimed = kind == "" and rudder > 0.0
                within = WITHIN_MEASURED[index]
                yield _measured_row(
                    f"Table {6 if rudder > 0.0 else 7}",
                    f"{rudder:+.0f} deg: {words}, L{kind and ', ' + kind}",
                    printed[index] if kind == "" else None,
                    [values[index] for values in found],
                    aim=(
                        (MEASURED[index], 0.01 * within * MEASURED[index])
                        if aimed
                        else None
                    ),
                    words=f"within {within:g} % of {MEASURED[index]:g}",
                    note=(
                        ""
                        if rudder > 0.0
                        else "the measured values printed for -35 are those of +35"
                    ),
                )


def _measured_models(target: Target | None) -> dict[str, list[ShipModel]]:
    """Errors their way, at best and of the bare reference; none without the data."""
    if target is None:
        return {"": [], BARE: []}
    return {
        "": [papers_way(target).model, our_way(target, TANKER).model],
        BARE: [target.bare(TANKER)],
    }


def _measured_row(
    case: str,
    quantity: str,
    printed: float | None,
    ours: Sequence[float | None],
    aim: tuple[float, float] | None = None,
    words: str = "",
    note: str = "",
) -> Row:
    """A row on MARIN's zigzags.

    `ours` is their way and at best, or at best alone, and empty where the data is not
    at hand; `aim` is a value and how far off one may be.
    """
    case = f"{case}: MARIN"
    if not ours:
        return Row(case, quantity, printed, None, None, note=NO_DATA)
    theirs, best = (None, *ours)[-2:]
    met = None if aim is None else best is not None and abs(best - aim[0]) < aim[1]
    return Row(
        case, quantity, printed, theirs, best, "" if aim is None else words, met, note
    )


def _pair(values: Iterable[float | None]) -> Pair:
    """Their way and at best."""
    theirs, best = values
    return theirs, best


def _error(value: float | None, truth: float | None) -> float | None:
    return None if value is None or truth is None else 100.0 * (value / truth - 1.0)


def _within(error: float | None, limit: float) -> bool:
    return error is not None and abs(error) < limit


def _turn(rudder: float, words: str, kind: str = "") -> str:
    return (
        f"Table {6 if rudder > 0.0 else 7}: MARIN: {rudder:+.0f} deg: {words},"
        f" L{kind and ', ' + kind}"
    )


def _off(row: Row, index: str) -> float:
    """Error of a turn by their way, or of the bare reference, of what was measured."""
    value = row.best if row.as_paper is None else row.as_paper
    return abs((value or 0.0) / MEASURED[index] - 1.0)


CONCLUSIONS = (
    Conclusion(
        "By five particulars the tanker is the ship most like KVLCC2",
        ("Table 4: the tanker is chosen (1: yes)",),
        lambda found: found.as_paper == 1.0,
    ),
    Conclusion(
        "The reference ship replicates the dynamics of the target very well",
        tuple(
            f"Figure 5: MARIN: correlation of {word} accelerations, reference and"
            " target"
            for word in ("surge", "sway", "yaw")
        ),
        lambda *found: all(row.as_paper > 0.9 for row in found),
        "very well: a correlation above 0.9; a correlation does not see scale or"
        " offset",
    ),
    Conclusion(
        "RM-SVM predicts turns from zigzags of small rudder angles (generalisation)",
        tuple(_turn(HARD, words) for words in WORDS.values()),
        lambda advance, tactical: (
            _off(advance, "advance") < 0.05 and _off(tactical, "tactical") < 0.05
        ),
        "within 5 % of the measured turn to starboard; what is printed as measured at"
        " -35 is that of +35",
    ),
    Conclusion(
        "It is the support vector machine that makes the prediction accurate, beyond"
        " the reference ship",
        (
            *(_turn(HARD, words) for words in WORDS.values()),
            *(_turn(HARD, words, BARE) for words in WORDS.values()),
        ),
        lambda advance, tactical, bare_advance, bare_tactical: (
            _off(advance, "advance") < _off(bare_advance, "advance")
            and _off(tactical, "tactical") < _off(bare_tactical, "tactical")
        ),
        "on MARIN's turn; the bare tanker is 1 and 6 % off",
    ),
    Conclusion(
        "The same with the MMG model as the target",
        tuple(
            f"{VIRTUAL}: +35 deg: {words}{kind}, error, %"
            for kind in ("", f", {BARE}")
            for words in WORDS.values()
        ),
        lambda advance, tactical, bare_advance, bare_tactical: (
            abs(advance.as_paper) < abs(bare_advance.as_paper)
            and abs(tactical.as_paper) < abs(bare_tactical.as_paper)
        ),
        "where the bare reference happens to be right, a correction from zigzags can"
        " spoil it",
    ),
    Conclusion(
        "The zigzag's overshoots are acceptable (Table 5)",
        (
            "Table 5: MARIN: 20/20: 1st overshoot, deg",
            "Table 5: MARIN: 20/20: 2nd overshoot, deg",
        ),
        lambda first, second: (
            abs(first.as_paper - MEASURED["overshoot_1"]) < 2.0
            and abs(second.as_paper - MEASURED["overshoot_2"]) < 2.0
        ),
        "within 2 deg of the measured ones, as printed",
    ),
    Conclusion(
        "The adaptive search finds the insensitive bands",
        tuple(
            f"Figure 6: MARIN: insensitive band of {word}"
            for word in ("surge", "sway", "yaw")
        ),
        lambda *found: all(row.agrees for row in found),
        "it finds others, of about the same correlation of headings: without C the"
        " bands mean little, and a correlation ignores scale and offset",
    ),
    Conclusion(
        "It is more accurate than computational fluid dynamics (Tables 5 to 7)",
        remark=(
            "those results are not ours; one model test without repetition bounds"
            " neither"
        ),
    ),
)
PAPER = Paper(
    "mei2019",
    "Mei, Sun, Shi & Liu 2019, Ship maneuvering prediction using grey box framework via"
    " adaptive RM-SVM with minor rudder",
    "KVLCC2 from 10/10 and 20/20 zigzags: a reference ship plus a linear support vector"
    " regression, to predict 35 deg turns; the MMG model as the target ship, and"
    " MARIN's measured zigzags.",
    rows,
    conclusions=CONCLUSIONS,
)
