"""The shipped measurements; `data/` says where each comes from and under which licence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from plantune.io import read
from plantune.record import Record

_DATA: Final = Path(__file__).parent / "data"


def hair_dryer() -> Record:
    """Return the record of a laboratory hair dryer: heater drive to air temperature.

    1000 rows, `Ts` 0.08 s; the input switches at random between two levels.

    Returns
    -------
    Record
        Input `power`, volts; output `temp`, volts of a thermocouple.

    Notes
    -----
    SLICOT-Reference, example IB01AD, BSD-3-Clause; measured as record 96-006 of DaISy.

    Examples
    --------
    >>> print(hair_dryer())
    Record power -> temp: 1000 rows, Ts 0.08 s, 1 segment
    """
    return read(_DATA / "hair_dryer" / "hair_dryer.csv", u="power", y="temp", Ts=0.08)


def robot_arm() -> Record:
    """Return the record of a flexible robot arm: reaction torque to acceleration.

    1024 rows.  The source does not state the sampling time: `Ts` is 1.0 and the unit of time is
    the sample.

    Returns
    -------
    Record
        Input `torque`, output `acceleration`; units not stated.

    Notes
    -----
    SLICOT-Reference, example IB03AD, BSD-3-Clause; measured as record 96-009 of DaISy.

    Examples
    --------
    >>> rec = robot_arm()
    >>> print(rec)
    Record torque -> acceleration: 1024 rows, Ts 1 sample, 1 segment
    >>> rec.log[-1]
    'the source does not state the sampling time: Ts = 1.0, unit sample'
    """
    rec = read(
        _DATA / "robot_arm" / "robot_arm.csv",
        u="torque",
        y="acceleration",
        Ts=1.0,
        units={"time": "sample"},
    )
    said = "the source does not state the sampling time: Ts = 1.0, unit sample"
    return replace(rec, log=(*rec.log, said))
