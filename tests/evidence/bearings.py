"""The estimate that chooses the eccentricity of a bearing's annulus."""

from __future__ import annotations

from crescentlab.components.bearings import short_bearing_eccentricity, short_bearing_sommerfeld

from evidence import Number, evidence


@evidence(
    "annular_gap",
    source="Raimondi & Boyd, Trans. ASLE 1 (1958) 159-209, full journal bearing, L/D = 1/4",
    tolerance=0.05,
    because="Ocvirk's solution leaves out the flow round the journal, 2 to 4 % at this L/D",
)
def loaded_journal() -> list[Number]:
    """Sommerfeld number of a short bearing over its eccentricity, and back."""
    table = {0.1: 16.2, 0.2: 7.57, 0.4: 2.83}
    found = [Number(f"S at eccentricity {e:g}", s, short_bearing_sommerfeld(e, 0.25)) for e, s in table.items()]
    return [*found, Number("eccentricity at S = 2.83", 0.4, short_bearing_eccentricity(2.83, 0.25))]
