"""The replay page: recorded episodes in one HTML file that works offline."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

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
    files = [Path(path) for path in paths]
    titles = names(files)
    episodes = {}
    for title, path in zip(titles, files, strict=True):
        episode = Episode.load(path)
        episodes[title] = episode

    page = replay_page(episodes)
    write_text(page, target)


def replay_page(episodes: Mapping[str, Episode]) -> str:
    """HTML that loads nothing, of episodes by their titles; InputError without any."""
    if not episodes:
        raise InputError("episodes: expected at least one, got none")
    runs = []
    models: dict[str, None] = {}  # each once, in their order
    for title, episode in episodes.items():
        runs.append(run(title, episode))
        models[episode.model] = None
    return render(
        PLAYER,
        title=f"Replay: {', '.join(models)}",
        data={"runs": runs, "quantities": quantities(runs)},
    )


def names(paths: Sequence[Path]) -> list[str]:
    """Titles of episode files that are different.

    They are names without ending, with as many folders as are needed. A file that is
    given twice is numbered.
    """
    stems = [path.absolute().with_suffix("").parts for path in paths]
    n_files = len(set(stems))
    depth = 1
    while len({stem[-depth:] for stem in stems}) < n_files:
        depth += 1

    titles = []
    times: Counter[str] = Counter()
    for stem in stems:
        title = str(PurePosixPath(*stem[-depth:]))
        times[title] += 1
        number = times[title]
        titles.append(title if number == 1 else f"{title} ({number})")
    return titles
