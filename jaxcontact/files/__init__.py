"""What is read and written: case files, results, and the directories of runs."""
