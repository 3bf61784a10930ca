"""Files: case files, results, and the directories of runs."""
