"""Malformed inputs, and the command that a user would run on each: what must hold is in trial.py.

cases.py        what a case is, and how files are spoilt
*_cases.py      the cases, by format
base.py         the sound files that are spoilt
trial.py        one case in a process of its own, and what is wrong with how it ended
__main__.py     `python tests/malformed`: all of them, and a table

Beside these hand-written cases there are small random changes of every format (flipped bits, cuts,
zeros, other numbers), repeatable by their seeds. A format of subjects.py has no such cases above:

subjects.py        an intact source of every format
mutations.py       kinds of changes
mutation_trial.py  one changed source, read in a fork, and compared with the intact one
sweep.py           `python tests/malformed/sweep.py`: all of them, and a table by format
"""
