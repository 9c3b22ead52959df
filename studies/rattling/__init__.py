"""Studies of the crank-rocker with clearance in its joints."""
