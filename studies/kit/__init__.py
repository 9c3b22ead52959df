"""What every study uses: parameters with units, report, figures, the table of studies, the command line."""
