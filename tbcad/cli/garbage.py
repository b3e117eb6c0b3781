"""Commands look for garbage seldom.

What they load stays to their end, and is much: looking for garbage among it again and again takes
an eighth of the time in which bad input is refused.
"""

import gc

# Objects that are made before the first look, and looks before those at older objects.
THRESHOLDS = (100_000, 20, 20)

gc.set_threshold(*THRESHOLDS)
