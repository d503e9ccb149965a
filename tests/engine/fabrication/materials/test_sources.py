from engine.fabrication.materials import Source, least_certain


def test_the_least_certain_source_wins():
    assert least_certain(Source.SIMULATED, Source.MEASURED) is Source.MEASURED
    assert least_certain(Source.ASSUMED, Source.MEASURED) is Source.ASSUMED
