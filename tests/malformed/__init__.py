"""Malformed inputs, each with the command that a user would run on it.

cases.py        what a case is, and functions that damage files
*_cases.py      the cases, by format
base.py         the intact files that cases damage
trial.py        runs one case in a separate process, and checks how it ended
__main__.py     `python tests/malformed`: all cases, and a table

Besides these hand-written cases there are small random changes of every format (flipped bits, cuts,
zeros, other numbers). A seed repeats each of them. They also cover formats without hand-written
cases:

subjects.py        an intact source of every format
mutations.py       kinds of changes
mutation_trial.py  reads one changed source in a fork, and compares it with the intact one
sweep.py           `python tests/malformed/sweep.py`: all changes, and a table by format
"""
