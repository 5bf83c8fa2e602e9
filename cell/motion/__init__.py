"""A motion as data: rows of joint angles with their times and targets, its files, and the speed it keeps.

Modules: ``motion``, ``motion_file`` (CSV and npz), ``deposition_speed`` (how much of the speed asked for is kept).
"""
