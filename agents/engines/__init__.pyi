from .jobs import run_jobs as run_jobs
