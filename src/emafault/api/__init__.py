"""What ``emafault`` offers Python: functions that the command line calls too, and their results as objects."""
