"""Import of measured data: from files of any logger to a bench in the recording format, described by one map."""
