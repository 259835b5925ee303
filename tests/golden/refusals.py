"""What steering's own functions say where they refuse: golden texts, one a part of the package.

Of numbers with a limit one just within it and one just beyond are tried; what is
accepted says so.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from agents import LQ, PID, LearnedPolicy
from agents.agent_file import load_agent
from agents.controllers import designs, registry, robustness, turn_rate
from agents.controllers.checker import check_controller
from agents.controllers.controller import Controller
from agents.controllers.controller_file import read_controller
from agents.controllers.linear_loop import check_stable
from agents.deployment.c99 import autopilot_source, checked_name
from agents.deployment.helm import Helm
from agents.deployment.route import Route
from agents.deployment.sensors import Limits
from agents.deployment.translator import c_name, literal
from agents.policies.network import Network
from agents.policies.onnx_export import onnx_model
from agents.policies.policy_extraction import actor_network, task_showing
from agents.policies.sb3_zip import Sb3Agent
from agents.policies.weights_file import as_json
from agents.rollouts.course_keeping import sail, step_response
from agents.rollouts.replay_page import names
from agents.rollouts.replay_series import outcome
from agents.rollouts.rollout import rollout
from agents.suites.suite import (
    BenchmarkTask,
    find_task,
    load_suite,
    parse_suite,
)
from agents.verification.monte_carlo import monte_carlo
from shipgym import InputError, load_model
from shipgym.sea.conditions import Current, Weather
from shipgym.tasks.task import Task, course_keeping_task, path_following_task
from tests.agents.policies import MARINER, random_network, random_policy
from tests.golden.controllers import SETTINGS
from tests.golden.policies import path_policy
from tests.golden.rollouts import SUITE

Call = Callable[[], Any]


def refused(name: str, *calls: Call) -> Iterator[str]:
    """A line for each call: what it says where it refuses, else that it does not."""
    for call in calls:
        try:
            call()
        except (InputError, TypeError, ValueError, RuntimeError) as error:
            yield f"{name}: {error}"
        else:
            yield f"{name}: accepted"


def of_controllers() -> Iterator[str]:
    """Settings of designs, files, states and observations, and what a file may hold."""
    made = {kind: registry.controller_class(kind) for kind in registry.BUILT_IN}
    for kind, one in made.items():
        ranges = ", ".join(
            f"{name} {tuple(limits)}" for name, limits in one.ranges.items()
        )
        yield (f"{kind}: observes {one.observes}, gains {one.gain_names}, {ranges}")
    tried: dict[str, list[dict[str, Any]]] = {
        "pid": [
            {"dt": 0.0},
            {"integral_lengths": 0.0},
            {"frequency": 0.0},
            {"damping": 0.0},
            {"frequency": 9.0},
        ],
        "lq": [
            {"rudder_weight": 0.0},
            {"rate_weight_s2": 0.0},
            {"integral_lengths": 0.0},
            {"dt": -1.0},
        ],
        "lqg": [
            {"noise": 0.0},
            {"disturbance_deg": 0.0},
            {"wave_period": 2.0},
            {"wave_period": 9.0, "wave_heading_deg": 0.0},
        ],
        "turn-rate": [
            {"frequency": 0.0},
            {"rate_deg_min": 0.0},
            {"rate_deg_min": 900.0},
        ],
        "los": [
            {"lookahead_lengths": 0.0},
            {"integral_lengths": 0.0},
            {"autopilot": PID.from_model(load_model("kvlcc2"))},
        ],
        "wheel-over": [
            {"crab_share": 2.0},
            {"crab_share": 2.1},
            {"crab_share": -0.1},
            {"reach_lengths": 0.0, "radius_lengths": 1.0},
        ],
        "mpc": [
            {"horizon_lengths": 40.1},
            {"deviation_deg": 60.0},
            {"deviation_deg": 60.1},
            {"autopilot": PID.from_model(MARINER)},
        ],
    }
    small = {
        "pid": ("dt", "integral_lengths", "frequency", "damping"),
        "lq": ("rudder_weight", "rate_weight_s2", "integral_lengths"),
        "lqg": ("noise", "disturbance_deg"),
        "turn-rate": ("dt", "frequency", "rate_deg_min"),
        "los": ("lookahead_lengths", "integral_lengths"),
        "wheel-over": (
            "lookahead_lengths",
            "radius_lengths",
            "reach_lengths",
            "crab_share",
        ),
        "mpc": ("horizon_lengths", "deviation_deg"),
    }
    for kind, names_ in small.items():
        tried[kind] += [{name: 0.05} for name in names_]
    for kind, settings in tried.items():
        for one in settings:
            shown = {
                name: value if isinstance(value, float | list) else "..."
                for name, value in one.items()
            }
            yield from refused(
                f"{kind} {shown}",
                lambda kind=kind, one=one: made[kind].from_model(MARINER, **one),
            )
    yield from refused("turns", lambda: turn_rate.steady_turns(_weak(), 0.0))
    yield from refused(
        "stable",
        lambda: check_stable(np.diag([0.5, 1.0]), "here"),
        lambda: check_stable(np.diag([0.99]), "here"),
    )
    yield from refused(
        "robustness", lambda: robustness.margin_uncertainty(PID.from_model(MARINER), [])
    )
    nowhere = robustness.margin_uncertainty(PID.from_model(MARINER), [_weak(-1.0)])
    yield from refused("quantiles", nowhere.quantiles)
    yield from _files(made)
    yield from _controls()


def _weak(share: float = 0.0) -> Any:
    """The Mariner with another rudder."""
    changed = {
        name: value * (share if "d" in name else 1.0)
        for name, value in MARINER.coefficients.items()
    }
    return replace(MARINER, coefficients=changed)


def _files(made: dict[str, Any]) -> Iterator[str]:
    """Files of controllers with one field changed."""
    own = {
        kind: made[kind].from_model(MARINER, **SETTINGS[kind]).to_dict()
        for kind in ("pid", "lqg", "ilos")
    }
    changes: list[tuple[str, dict[str, Any]]] = [
        ("pid", {"format": 2}),
        ("pid", {"kind": "pd"}),
        ("pid", {"kind": "learned"}),
        ("pid", {"observation_names": "all"}),
        ("pid", {"observation_names": ["heading_error_sin"]}),
        ("pid", {"gains": {"proportional": 1.0}}),
        ("pid", {"gains": {**own["pid"]["gains"], "integral": 1.01e9}}),
        ("pid", {"gains": {**own["pid"]["gains"], "integral": 1e9}}),
        ("pid", {"neutral_rudder": 3.15}),
        ("pid", {"neutral_rudder": 3.14}),
        ("pid", {"neutral_sway": 2e9}),
        ("pid", {"margins": {}}),
        ("pid", {"margins": dict.fromkeys(own["pid"]["margins"])}),
        ("pid", {"design": {}}),
        ("pid", {"design": {"dt": 0.00099}}),
        ("pid", {"design": {"dt": 10001.0}}),
        ("pid", {"model": {"name": 3}}),
        ("pid", {"observation_scales": [1.0]}),
        ("pid", {"observation_scales": "1"}),
        ("pid", {"arrays": {}}),
        (
            "pid",
            {"observation_scales": [0.9e-9, *own["pid"]["observation_scales"][1:]]},
        ),
        ("lqg", {"arrays": {**own["lqg"]["arrays"], "input": [1.0]}}),
        ("lqg", {"arrays": {**own["lqg"]["arrays"], "kalman": [[9.0, 0.0]] * 5}}),
        (
            "lqg",
            {
                "arrays": {
                    **own["lqg"]["arrays"],
                    "transition": (1.3 * np.eye(5)).tolist(),
                }
            },
        ),
        ("lqg", {"arrays": {**own["lqg"]["arrays"], "output": [[2e9] * 5] * 2}}),
        ("ilos", {"autopilot": own["ilos"]}),
        ("ilos", {"autopilot": 3}),
        ("ilos", {"gains": {**own["ilos"]["gains"], "lookahead": 0.0}}),
    ]
    for kind, change in changes:
        yield from refused(
            f"{kind} {sorted(change)}",
            lambda c={**own[kind], **change}: read_controller(c, "file"),
        )


def _controls() -> Iterator[str]:
    """Observations, states, designs for tasks and registration."""
    lq, ilos = (
        LQ.from_model(MARINER),
        registry.controller_class("ilos").from_model(MARINER),
    )  # type: ignore[attr-defined]
    filtered = registry.controller_class("lqg").from_model(MARINER)  # type: ignore[attr-defined]
    seen = np.zeros((2, 8))
    yield from refused(
        "predict",
        lambda: lq.predict(np.zeros(7)),
        lambda: lq.predict(np.zeros((2, 2, 8))),
        lambda: ilos.predict(seen),
        lambda: filtered.predict(seen, np.zeros(3)),
        lambda: filtered.predict(seen, np.zeros((2, 4)), [True] * 3),
        lambda: lq.check_fits(["heading_error_sin", "yaw_rate"], [1.0, 1.0]),
        lambda: lq.check_fits_model(load_model("tanker")),
        lambda: lq.check_fits(
            lq.observation_names[:-1], lq.observation_scales[:-1], "here"
        ),
        lambda: lq.check_fits(
            lq.observation_names, [1.000002, *lq.observation_scales[1:]], "here"
        ),
        lambda: lq.check_fits(
            lq.observation_names, [1.0000005, *lq.observation_scales[1:]], "here"
        ),
        lambda: replace(ilos, autopilot=random_policy()).to_dict(),
        lambda: replace(ilos, autopilot=random_policy()).loop(),
    )
    task, path = (
        BenchmarkTask("mariner-calm", "course-keeping", "mariner"),
        load_suite().task("sharp-turns").design_task,
    )
    yield from refused(
        "design",
        lambda: designs.design("los", task),
        lambda: designs.design("pd", task),
        lambda: designs.tuned("mpc-x", task, "shipgym-v1"),
        lambda: designs.design_base("none", task),
        lambda: designs.design_base("tuned", replace(task, name="mine")),
        lambda: designs.design_base("los", replace(task, name="")),
        lambda: designs.design_base("nowhere.json", path),
    )

    class Nameless(Controller):
        kind = "a b"

    class Taken(LQ):
        kind = "pid"

    class Without(Controller):
        kind = "mine"

    yield from refused(
        "register",
        lambda: registry.register_controller(int),
        lambda: registry.register_controller(Nameless),  # type: ignore[type-var]
        lambda: registry.register_controller(Taken),
        lambda: registry.register_controller(Without),
        lambda: registry.register_controller(LQ),
    )
    answers: dict[str, Callable[[Any], Any]] = {
        "one": lambda seen: np.zeros((*np.shape(seen)[:-1], 1)),
        "no pair": lambda seen: None,
        "text": lambda seen: "x",
        "shape": lambda seen: np.zeros(3),
        "nan": lambda seen: np.full((*np.shape(seen)[:-1], 1), np.nan),
        "large": lambda seen: np.full((*np.shape(seen)[:-1], 1), 1.01),
        "mixed": lambda seen: np.full_like(seen[..., :1], seen.mean()),
    }
    for name, answer in answers.items():
        one = SimpleNamespace(
            predict=lambda seen, state=None, episode_start=None, deterministic=True, a=answer: (
                (a(seen), state) if a(seen) is not None else 3
            )
        )
        yield from refused(
            f"check {name}", lambda one=one: check_controller(one, n_steps=2)
        )
    wrong = SimpleNamespace(
        predict=lq.predict,
        observation_names=lq.observation_names,
        observation_scales=[2.0],
    )
    yield from refused(
        "check",
        lambda: check_controller(3),
        lambda: check_controller(lq, n_steps=1),  # type: ignore[arg-type]
        lambda: check_controller(wrong, n_steps=2),
    )


def of_policies() -> Iterator[str]:
    """Fields, files, states and exports of learned policies."""
    base, n = LQ.from_model(MARINER), random_network
    weight, bias = np.ones((2, 3), np.float32), np.ones(2, np.float32)
    fields: list[dict[str, Any]] = [
        {"action": "shaft"},
        {"authority": 0.5},
        {"base": base, "authority": 2.01},
        {"base": base, "authority": 2.0},
        {"frame_stack": 0},
        {"action_repeat": 0},
        {"rate_limit": 2.01},
        {"rate_limit": 0.0},
        {"observation_scales": (1.0,)},
        {"action": "rudder-discrete", "rate_limit": 1.9},
        {"base": base, "action": "rudder-shaft"},
        {"network": n(7, 1)},
        {"network": n(8, 2)},
        {"base": LQ.from_model(load_model("tanker"))},
    ]
    for one in fields:
        yield from refused(
            f"policy {sorted(one)}", lambda one=one: random_policy(**one)
        )
    yield from refused(
        "network",
        lambda: Network(()),
        lambda: Network(((weight, bias[:1]),)),
        lambda: Network(((weight[0], bias),)),
        lambda: Network(((weight * np.nan, bias),)),
        lambda: Network(((weight.astype(float), bias),)),  # type: ignore[arg-type]
        lambda: Network(((weight, bias), (weight, bias))),
        lambda: Network(((weight, bias),), "selu"),
        lambda: Network(((weight, bias),), output="relu"),
    )
    policy, stacked = random_policy(), random_policy(frame_stack=2)
    yield from refused(
        "predict",
        lambda: policy.predict(np.zeros(7)),
        lambda: stacked.predict(np.zeros(8), 3),
        lambda: stacked.predict(
            np.zeros((2, 8)), (np.zeros((1, 1, 8)), None, np.zeros((2, 3)))
        ),
        lambda: policy.check_fits_model(load_model("tanker")),
        lambda: path_policy().check_fits_model(MARINER),
        lambda: policy.check_fits(["a"], [1.0]),
    )
    weather = Weather(current=Current(0.7))
    options = {
        "a": MARINER,
        "b": (np.inf, -np.inf, np.nan, np.float64(2.5)),
        "c": weather,
        3: Path("x"),
    }
    yield f"as JSON: {as_json(options)}"
    shown = ["a"], ["cross_track"]
    yield f"tasks: {[task_showing(some) for some in shown]}"
    yield from _written(policy, base)
    yield from _exported()


def _written(policy: Any, base: Any) -> Iterator[str]:
    """Files of policies as they are read again, and what is refused of them."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "agent.json"
        for one in (
            policy,
            random_policy(base=base, frame_stack=2),
        ):
            one.save(path)
            again = load_agent(path)
            seen = np.linspace(-0.5, 0.5, 8)
            yield f"read: {again.name} {again.predict(seen)[0]} {one.predict(seen)[0]}"
        yield from refused(
            "file",
            lambda: policy.save(Path(folder) / "agent.txt"),
            lambda: load_agent(Path(folder) / "none.json"),
        )


def _exported() -> Iterator[str]:
    """Graphs of ONNX, node by node, and networks of stable-baselines3 by the names of their weights."""
    base = LQ.from_model(MARINER)
    made: dict[str, LearnedPolicy] = {
        "tanh": random_policy(
            network=random_network(8, 16, 1, activation="tanh", output="tanh")
        ),
        "discrete": random_policy(action="rudder-discrete"),
        "shaft": random_policy(action="rudder-shaft"),
        "residual": random_policy(base=base, authority=0.6, frame_stack=2),
    }
    for name, policy in made.items():
        graph = onnx_model(policy).graph
        nodes = [
            f"{node.op_type}({', '.join(node.input)}) {node.output[0]}"
            f" {len(node.attribute)}"
            for node in graph.node
        ]
        ends = [
            f"{one.name} {one.type.tensor_type.shape.dim[-1].dim_value}"
            for one in (*graph.input, *graph.output)
        ]
        yield (
            f"{name}:"
            f" {'; '.join([*nodes, *ends, *(one.name for one in graph.initializer)])}"
        )
    yield from refused("onnx", lambda: onnx_model(base))

    def tensor(*shape: int) -> Any:
        kept = SimpleNamespace(numpy=lambda: np.ones(shape))
        return SimpleNamespace(detach=lambda: SimpleNamespace(cpu=lambda: kept))

    for body, head in (
        ("mlp_extractor.policy_net", "action_net"),
        ("actor.latent_pi", "actor.mu"),
        ("actor.mu", "actor.mu.2"),
    ):
        weights = {
            f"{body}.0.weight": tensor(4, 8),
            f"{body}.0.bias": tensor(4),
            f"{head}.weight": tensor(1, 4),
            f"{head}.bias": tensor(1),
        }
        found = actor_network(weights, None, "an agent")
        yield f"{body}: {found.sizes} {found.activation} {found.output}"
        yield from refused(
            body,
            lambda w=weights: actor_network(w, "GELU", "an agent"),
            lambda w=weights: actor_network({**w, "more": tensor(1)}, None, "it"),
            lambda w=weights: actor_network({**w, "critic.x": tensor(1)}, "ReLU", "it"),
        )
    yield from refused("actor", lambda: actor_network({}, None, "a DQN"))
    task = course_keeping_task()
    bounds = np.array([(one.low, one.high) for one in task.observed(MARINER)])
    zipped = Sb3Agent(Path("model.zip"), random_network(8, 16, 1), bounds)
    yield (
        f"zip: {zipped.policy(task, MARINER).env_id}"
        f" {zipped.policy(task, MARINER).model_name}"
    )
    yield from refused(
        "zip",
        lambda: replace(zipped, bounds=1.1 * bounds).policy(task, MARINER),
        lambda: zipped.policy(path_following_task(), MARINER),
    )


def of_deployment() -> Iterator[str]:
    """What a helm, a route and C refuse."""
    pid, wheel = (
        PID.from_model(MARINER),
        registry.controller_class("wheel-over").from_model(
            MARINER, task=Task.of("PathFollowing")
        ),
    )  # type: ignore[attr-defined]
    rate = registry.controller_class("turn-rate").from_model(MARINER)  # type: ignore[attr-defined]
    places = np.array([[54.0, 7.5], [54.02, 7.5], [54.03, 7.52]])
    yield from refused(
        "helm",
        lambda: Helm(pid, 0.0, Limits(), rate=0.01),
        lambda: Helm(pid, 0.0, Limits(), Route(places, 300.0)),
        lambda: Helm(wheel, None, Limits()),
        lambda: Helm(rate, 0.1, Limits(), rate=9.0),
        lambda: Helm(rate, 0.1, Limits(), rate=0.0),
        lambda: Helm(random_policy(action="rudder-shaft"), 0.0, Limits()),
        lambda: Helm(path_policy(), 0.0, Limits(), Route(places, 300.0)),
        lambda: Limits(silence_s=0.0),
        lambda: Limits(silence_s=0.05),
    )
    yield f"limits: {Limits()}"
    yield from refused(
        "route",
        lambda: Route(places, 3000.0),
        lambda: Route(places + np.array([[0.0, 0.0], [0.9, 0.0], [0.0, 0.0]]), 300.0),
        lambda: Route(np.array([[0.0, 0.0], [0.904, 0.0]]), 300.0),
        lambda: Route(np.array([[0.0, 0.0], [0.905, 0.0]]), 300.0),
        lambda: Route(places[[0, 0]], 300.0),
    )
    with tempfile.TemporaryDirectory() as folder:
        for rows in (
            "54.0,7.5",
            "54.0,7.5\n54.02,7.5",
            "54.0,7.5\n89.1,7.5",
            "54.0,7.5\n54.0,180.1",
            "54.0,7.5\n54.0,x",
        ):
            path = Path(folder) / "route.csv"
            path.write_text(f"latitude,longitude\n{rows}\n")
            yield from refused(
                f"csv {rows!r}", lambda path=path: Route.from_csv(path, 300.0)
            )
    for name in ("ship-1", "1ship", "while", "x" * 31, "x" * 32, "a b", ""):
        yield from refused(f"name {name!r}", lambda name=name: checked_name(name))
    numbers = [literal(x) for x in (1, True, -2.5, np.inf, -np.inf, np.nan, 1e-9)]
    yield f"{checked_name('ship-1 b')} {c_name('while')} {c_name('x')} {numbers}"
    preview = registry.controller_class("mpc").from_model(MARINER)  # type: ignore[attr-defined]
    yield from refused(
        "C",
        lambda: c_name("\u00e4"),
        lambda: autopilot_source(preview),
        lambda: autopilot_source(pid, "if"),
    )


def of_rollouts() -> Iterator[str]:
    """What rollouts, suites and Monte Carlo refuse."""
    pid, task = PID.from_model(MARINER), Task.of("CourseKeeping", episode_steps=5)
    answers: list[Callable[[Any], Any]] = [
        lambda seen: "x",
        lambda seen: np.zeros(2),
        lambda seen: np.where(np.arange(len(seen))[:, None] > 1, np.inf, 0.0),
    ]
    for answer in answers:
        for tolerant in (False, True):
            policy = SimpleNamespace(
                predict=lambda seen, state, starts, sure, a=answer: (a(seen), state)
            )
            bench = BenchmarkTask(
                "mine", "course-keeping", "mariner", options={"episode_steps": 4}
            )
            run = lambda p=policy, t=tolerant, b=bench: rollout(  # noqa: E731
                p, b.engine(3), [1, 2, 3], tolerant=t
            )
            yield from refused(f"tolerant {tolerant}", run)
            yield f"failure: {run().failure}" if tolerant else ""
    yield from refused(
        "sail",
        lambda: sail(pid, []),
        lambda: sail(pid, MARINER, task, "a"),
        lambda: sail(pid, MARINER, task, []),
        lambda: sail(pid, [MARINER] * 2, task, [1, 2, 3]),
        lambda: sail(pid, load_model("tanker"), task),
        lambda: step_response(pid, MARINER, 60.1),
        lambda: step_response(pid, MARINER, -60.1),
        lambda: step_response(pid, MARINER, duration=0.0),
        lambda: step_response(pid, MARINER, duration=0.05),
    )
    ended: list[tuple[bool, bool, bool | None]] = [
        (False, True, None),
        (False, False, None),
        (True, False, False),
        (True, False, True),
        (False, True, False),
    ]
    yield f"ended: {[outcome(SimpleNamespace(terminated=a, truncated=b, success=c)) for a, b, c in ended]}"  # type: ignore[arg-type]
    files = ["/a/b/one.json", "/a/c/one.json", "/a/c/one.json", "/two.json"]
    yield f"names: {names([Path(file) for file in files])}"
    for old, new in (
        ("speed = 0.5", "speed = -1"),
        ('model = "mariner"', 'model = "marine"'),
        ('ship = "mariner"', "x = 1"),
        ("noise = 0.7", "noise = -0.7"),
        ("rudder_rate_deg_s = 1.7", "rudder_rate_deg_s = -1.7"),
        ('environment = "course-keeping"', 'environment = "course"'),
        ('ship = "mariner"\n', ""),
        ('ship = "mariner"\n', 'ship = "tanker"\n'),
        ('name = "mine-v1"', "other = 1"),
    ):
        yield from refused(
            f"suite {new!r}",
            lambda old=old, new=new: parse_suite(SUITE.replace(old, new), "mine"),
        )
    yield from refused(
        "suite",
        lambda: load_suite("shipgym-v2"),
        lambda: find_task("sharp-turn"),
        lambda: load_suite().task("x"),
    )
    yield f"of: {find_task('roll-limit').name}"
    model = load_model("mariner-tls-svm")
    yield from refused(
        "draws",
        lambda: monte_carlo([], model, 1),
        lambda: monte_carlo([], model, 2, -1),
        lambda: monte_carlo([PID.from_model(load_model("tanker"))], model, 2),
        lambda: monte_carlo([], MARINER, 2),
    )


def text(part: str) -> str:
    """The lines of a part."""
    lines: Iterator[str] = {
        "controllers": of_controllers,
        "policies": of_policies,
        "deployment": of_deployment,
        "rollouts": of_rollouts,
    }[part]()
    return "\n".join(line for line in lines if line)


PARTS = ("controllers", "policies", "deployment", "rollouts")
