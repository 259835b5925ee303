"""Hooks: functions that loops call, and that are replaced when a loop is compiled.

A loop over ships is written against these names. When it is compiled for a ship, a sea,
a sensor set and a task, each is replaced by the function of that name that one of them
provides (`shipgym.engine.specialise`): `CompiledShip.hooks`, `CompiledSea.hooks` and
`EpisodeProgram.hooks` give them. Two more hooks, `accelerations` and
`shaft_acceleration`, have a body of their own and stand in `shipgym.engine.motion`.
"""

from typing import Any

from shipgym.engine.specialise import called


def given(*arguments: Any) -> Any:
    """Stand for a function that becomes part of the loops that name it."""
    raise NotImplementedError("a hook, given when a loop is compiled")


@called
def given_and_called(*arguments: Any) -> Any:
    """Stand for a function that loops call."""
    raise NotImplementedError("a hook, given when a loop is compiled")


# Functions of records, written from their rows (`shipgym.engine.record_code`):
# `load_NAME(array, lane)` returns a record, `store_NAME(array, lane, record)` writes
# one. Where the array is a vector and not a tile, the lane does not matter.

# of a lane, in its tile of states
load_motion = store_motion = given  # `Motion`
load_sea = store_sea = given  # state of the sea around the ship; zeros in calm water
load_commands = store_commands = given  # `Commands`
load_counters = store_counters = given  # `EpisodeCounters`
load_memory = store_memory = given  # `Memory` of the sensor set
load_task_state = store_task_state = given  # `State` of the task

# of a control interval, in the room for results
load_outcome = store_outcome = given  # `Outcome`
store_reward = given  # `Reward` of the task
# store_observation(array, lane, record, scale): times `scale`, clipped to its bounds
store_observation = given
no_reward = given  # () -> `Reward` of zeros
total_reward = given  # (`Reward`) -> sum of its parts

# of ships, random numbers, settings and arguments
load_ship = given  # `Ship`
load_coefficients = given  # coefficients of the ship, a record of hers
load_sea_parameters = given  # parameters of the sea around the ship
load_envelope = given  # `Envelope`
load_scale = given  # factors of the observations, an `Observation`
load_random = store_random = given  # `Random`
load_sea_random = store_sea_random = given  # `SeaRandom`
load_rules = given  # `Rules`
load_sensor_settings = given  # `Settings` of the sensor set
load_task_settings = given  # `Settings` of the task in a lane
load_arguments = given  # `Arguments`
store_sea_channels = given  # `SeaChannels`, behind the state of a row

# between the stages of a step (`shipgym.engine.stages`), with the results
load_point = store_point = given  # `Point`
load_sums = store_sums = given  # `Sums` over the rows of the table so far
load_slope = store_slope = given  # `Rates` at the stage before
load_slopes = store_slopes = given  # weighted sum of the `Rates` so far

# The ship
sail_lanes = given_and_called  # (tile, h, groups): move groups of ships by h seconds
point_of = given  # (motion, terms, ship) -> `Point` in the coordinates of her table
add_row = given  # (point, sums, terms, row) -> `Sums` with those of one row added
sum_accelerations = given  # (motion, sums, ship) -> in surge, sway and yaw

# The sea
push = given  # (motion, sea, parameters) -> `Push` of now
evolve = given  # (motion, h, sea, word, parameters) -> sea h seconds later
begin_sea = given_and_called  # (motion, word, parameters) -> sea of an episode's begin
encounter_frequency = given  # (motion, sea, parameters) -> rad/s; 0 in calm water

# The sensor set (interface: `shipgym.instruments.perfect`)
measure = given
readings = given

# The task (interface: `shipgym.tasks.contract`)
task_begin = given_and_called
task_step = given
observe = given
due = given
on_event = given_and_called
worst_cost = given
# a task and the reward of another file (`shipgym.tasks.definition.rewarded_step`)
step_of_task = given
reward_of_another = given
