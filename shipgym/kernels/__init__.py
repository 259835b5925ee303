"""What is compiled together with one ship: integration, steering gear, trajectories, environment steps.

The files of this folder are ordinary Python that Numba can compile. All of them take the ship from
`accelerations.py`, whose copy here is a body without forces. To compile a ship, the folder is copied
to the user's cache with that one file replaced (`shipgym.engine.compiled`), so that the ship is
inlined into every loop and Numba's on-disk cache is never stale. With `NUMBA_DISABLE_JIT=1` the same
files run as plain Python.
"""
