"""Colours that all pictures have in common, as the maps and the report of a run have them."""

import math

INK = (34, 34, 34)
# Of bodies without a field. No state and no value has a grey.
STEEL = (222, 225, 230)
# What pairs do in a period, by the number in the files, with the colours of Okabe and Ito.
STATES = [("stick", (0, 158, 115)),
          ("slip", (0, 114, 178)),
          ("open at times", (213, 94, 0)),
          ("close at times", (204, 121, 167)),
          ("stay open", (230, 159, 0))]
# Of fields on the flanks, from the least value to the largest in equal steps: viridis, whose lightness
# rises all the way.
VIRIDIS = [(68, 1, 84), (72, 36, 117), (65, 68, 135), (53, 95, 141), (42, 120, 142), (33, 145, 140),
           (34, 168, 132), (68, 191, 112), (122, 209, 81), (189, 223, 38), (253, 231, 37)]
# Of fields on bodies: from the grey of bodies to dark red, the lightness falls all the way.
BODIES = [(222, 225, 230), (253, 212, 158), (252, 141, 89), (215, 48, 31), (127, 0, 0)]


def unit(colour):
    """Red, green and blue from 0 to 1."""
    return [part / 255 for part in colour]


def ticks(most):
    """Round numbers from 0 to the first that is not below `most`, four to six of them."""
    if not most > 0:
        return [0.0, 1.0]
    power = 10.0 ** math.floor(math.log10(most / 5))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= 0.999999 * most / 5)
    return [float(f"{i * step:.6g}") for i in range(math.ceil(most / step - 1e-6) + 1)]
