"""How well a hard turn is known where no trial is one, in words."""

from collections.abc import Mapping
from typing import Any


def turn_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """What holds a hard turn of a model, by its provenance, and within how much."""
    sentences = []
    error = provenance.get("model_error", {}).get("hard_turn")
    if error:
        percent = 100.0 * error["size"]
        sentences.append(
            "No trial turns through half a circle: the angle of a hard turn is taken"
            f" to be known to {percent:.0f} % (standard error; {error['how']}). A turn"
            " at full rudder would show it."
        )
    choice = provenance.get("selection", {}).get("turns", {})
    passed_over = choice.get("predicts_better")
    if passed_over:
        sentences.append(
            f"The structure was taken for {choice['shown_by']}, known to turn:"
            f" {passed_over} predicts the trials held out better, but nothing shows"
            " that it turns."
        )
    return sentences
