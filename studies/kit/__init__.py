"""Tools of all studies: parameters with units, report, figures, the table of studies, the command line."""
