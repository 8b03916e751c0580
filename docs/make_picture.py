"""Draw the README's picture: one revolution of the crescent pump. Run `python docs/make_picture.py`."""

from pathlib import Path

import crescentlab as cl

if __name__ == "__main__":
    result = cl.load("crescent_pump").simulate(stop="60 ms", output_step="0.1 ms")
    names = ("delivery.p", "line.filter.p", "p_throttle.p")
    path = Path(__file__).with_name("crescent_pump.svg")
    result.plot(*names, path=path, title="Crescent pump: pressure ripple in the delivery line, 2000 rpm")
