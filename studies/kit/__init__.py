"""Tools of all studies: parameters with units, results and their files, figures, the table of studies, the command line."""
