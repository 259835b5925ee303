"""The replay page: recorded episodes in one HTML file that needs neither network nor installation."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from agents.output import check_page
from agents.rollouts.replay_series import quantities, run
from shipgym import Episode, InputError
from shipgym.files import write_text
from shipgym.pages import render

#: Template that loads nothing and replays its `data`: `runs` and `quantities`, or a
#: placeholder.
PLAYER = "agents.rollouts/replay.html"


def write_replay(paths: Sequence[str | Path], out: str | Path) -> None:
    """Write the replay page of recorded episodes.

    Raises InputError if there is no episode, one cannot be read, or the page cannot be
    written; nothing is written then.

    Parameters
    ----------
    paths : sequence of str or Path
        Episode files, of one ship or of several; the page shows them together.
    out : str or Path
        The HTML file; one that exists is replaced.
    """
    target = Path(out)
    check_page(target)
    if not paths:
        raise InputError("episodes: none found, expected at least one episode file")
    called = names([Path(path) for path in paths])
    episodes = {
        name: Episode.load(path) for name, path in zip(called, paths, strict=True)
    }
    write_text(replay_page(episodes), target)


def replay_page(episodes: Mapping[str, Episode]) -> str:
    """HTML that loads nothing, of episodes by what the legend calls them; InputError if there is none."""
    if not episodes:
        raise InputError("episodes: none found, expected at least one")
    runs = [run(name, episode) for name, episode in episodes.items()]
    ships = ", ".join(dict.fromkeys(episode.model for episode in episodes.values()))
    return render(
        PLAYER,
        title=f"Replay: {ships}",
        data={"runs": runs, "quantities": quantities(runs)},
    )


def names(paths: Sequence[Path]) -> list[str]:
    """Titles of episode files: names without ending, with as many folders as needed to be different.

    A file that is given twice is numbered.
    """
    stems = [path.absolute().with_suffix("").parts for path in paths]
    for depth in range(1, max(map(len, stems)) + 1):
        called = ["/".join(stem[-depth:]).replace("//", "/") for stem in stems]
        if len(set(called)) == len(set(stems)):
            break
    earlier = [called[:i].count(name) for i, name in enumerate(called)]
    return [
        name if k == 0 else f"{name} ({k + 1})"
        for name, k in zip(called, earlier, strict=True)
    ]
