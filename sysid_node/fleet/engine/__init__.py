"""The engine: every flight is worked on by one of Dask's worker processes, and each result comes back to the command.

``cluster`` starts workers here or connects to a scheduler that runs already. ``running`` hands out the flights, a few
more than there are workers, and takes what comes back; the work is a function that it is given. ``guarded`` runs that
function on a worker, under the flight's time limit.
"""
