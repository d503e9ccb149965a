import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tests.support.made_up import examples
from tests.support.unpacked import unpack
from viz.recording.packing import packed


@st.composite
def trials(draw):
    """Some arrays of equally many columns: of numbers as far apart as can be, and some columns alike."""
    n = draw(st.integers(1, 5))
    found = [draw(hnp.arrays(np.int16, (draw(st.integers(1, 6)), n))) for _ in range(draw(st.integers(1, 3)))]
    if draw(st.booleans()):
        for values in found:
            values[:, -1] = values[:, 0]
    return found


@examples(60)
@given(trials())
def test_packing_loses_nothing(values):
    read = unpack(packed(values), [len(v) for v in values], values[0].shape[1])
    for ours, theirs in zip(read, values, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_columns_that_follow_from_others_cost_next_to_nothing():
    rng = np.random.default_rng(1)
    alone = np.cumsum(rng.integers(-60, 60, (300, 4)), axis=0).astype(np.int16)
    both = np.concatenate([alone, alone + 7, alone // 2], axis=1).astype(np.int16)
    assert len(packed([both])) < 1.45 * len(packed([alone]))
