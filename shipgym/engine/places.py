"""Places that loops name and parts take: what a ship, a sea, a sensor set and a task put there.

Each function stands for one that is given when a loop is compiled (`shipgym.engine.specialise`); the one here
raises an error that names who gives it.
"""

from typing import Any

#: Functions by what gives them.
PLACES = {
    "records": (
        "load_motion", "store_motion", "choose_motion", "load_sea", "store_sea", "choose_sea", "load_course",
        "store_course", "store_ended", "store_ran_away", "load_outcome", "store_outcome", "load_state",
        "store_state", "choose_state", "load_memory", "store_memory", "choose_memory", "store_reward",
        "choose_reward", "no_reward", "total_reward", "store_observation", "read_rules", "read_sensor",
        "read_settings", "load_ship", "load_coefficients", "load_sea_parameters", "load_envelope",
        "load_scale", "row_of", "load_point", "store_point", "load_sums", "store_sums", "load_slope",
        "store_slope", "load_passed", "store_passed", "plan_of",
    ),
    "numbers of the ships": ("common_ship", "ship_at", "common_sea", "sea_at", "common_view", "view_at"),
    "a ship with a sum over a table": ("point_of", "row_sums", "sum_accelerations"),
    "the sea": ("push", "evolve", "begin_sea", "encounter_frequency"),
    "the sensor set": ("measure", "readings"),
    "the task": ("task_begin", "task_step", "observe", "due", "on_event", "worst_cost"),
    "a task and the reward of another": ("step_of_task", "reward_of_another"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """A function that raises an error naming who gives it."""
    giver = next((giver for giver, names in PLACES.items() if name in names), None)
    if giver is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def place(*arguments: Any) -> Any:
        raise RuntimeError(f"{name} is a place that {giver} fill when a loop is compiled")

    place.__name__ = name
    return place
