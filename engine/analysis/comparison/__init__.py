"""Runs side by side: in groups, described, tested.

Read in this order:

- ``measures``: the figures that runs are compared by.
- ``run_result``: what a comparison takes from one run.
- ``groups``: which runs repeat each other, and what their groups are called.
- ``statistics``: descriptive statistics, trends.
- ``significance``: rank tests, effect sizes, many tests at once.
- ``task_comparison``: the groups of a task, described and tested.
- ``fairness``: what makes a comparison less than fair.
- ``compare``: runs read and compared.
- ``published``: the paper's results. ``tables``: a comparison's numbers as CSV and Markdown.
"""

from engine.analysis.comparison.compare import Comparison, ReadingObserver, compare_runs
from engine.analysis.comparison.task_comparison import Group, PairTest, TaskComparison

__all__ = ["Comparison", "Group", "PairTest", "ReadingObserver", "TaskComparison", "compare_runs"]
