"""Malformed inputs, and the command that a user would run on each: what must hold is in trial.py.

cases.py        what a case is, and how files are spoilt
*_cases.py      the cases, by format
base.py         the sound files that are spoilt
trial.py        one case in a process of its own, and what is wrong with how it ended
__main__.py     `python tests/malformed`: all of them, and a table
"""
