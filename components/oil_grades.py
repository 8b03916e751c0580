"""Typical values of oils by their grade. No fluids here."""

from dataclasses import dataclass

from .viscosity_laws import CST


@dataclass(frozen=True)
class Grade:
    """Typical values of a grade of oil, SI."""

    density_15: float
    viscosity_40: float
    viscosity_100: float


GRADES = {
    "ISO VG 32": Grade(875.0, 32 * CST, 5.4 * CST),
    "ISO VG 46": Grade(879.0, 46 * CST, 6.7 * CST),
    "ISO VG 68": Grade(886.0, 68 * CST, 8.6 * CST),
    "SAE 15W-40": Grade(883.0, 109 * CST, 14.7 * CST),
    "ATF": Grade(865.0, 34 * CST, 7.2 * CST),
}
"""Typical, not those of one maker. ISO VG: hydraulic oils HLP (HM) of viscosity index 97 to 102; ISO 3448 allows 10 %
about the number at 40 degC. SAE 15W-40: a diesel engine oil of index 139; SAE J300 asks for 12.5 to 16.3 cSt at 100
degC (Mobil Delvac MX: 117 and 15.5 cSt, index 140, 880 kg/m^3). ATF: a Dexron III fluid of index 183 (Mobil
Multipurpose ATF: 36.3 and 7.4 cSt, 176, 846 kg/m^3; Mobil ATF 220, Dexron II: 37 and 7.0 cSt, 153, 870 kg/m^3)."""
