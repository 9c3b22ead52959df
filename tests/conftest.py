"""What all tests share: a quiet engine and figures without a display, both settled before anything is imported."""

import os

# A user's own Exudyn settings must not reach the tests; the engine reads this when it is imported.
os.environ["EXUDYN_NO_USER_SETTINGS"] = "1"
os.environ["MPLBACKEND"] = "Agg"
