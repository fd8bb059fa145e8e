"""The stages of a study, one function for each rule: they read files, call the numerical parts and write files."""
