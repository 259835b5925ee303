"""Where jobs are done: in this process, in others, on a Ray cluster."""

from agents.engines.jobs import run_jobs

__all__ = ["run_jobs"]
