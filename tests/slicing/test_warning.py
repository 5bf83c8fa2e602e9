import copy
import pickle

import pytest

from slicing.warning import Code, Warning, typed


def test_a_warning_is_its_text_and_keeps_what_it_is_about():
    told = Warning(Code.LAYER_AREA, "SV1, layer 3: wrong", sub_volume="SV1", layer=3)
    assert told == "SV1, layer 3: wrong"
    assert f"{told}" == "SV1, layer 3: wrong"
    for same in (pickle.loads(pickle.dumps(told)), copy.deepcopy(told), typed(told)):
        assert same.document() == {"code": "layer_area", "sub_volume": "SV1", "layer": 3, "text": "SV1, layer 3: wrong"}


def test_a_plain_line_is_of_the_code_other_and_an_unknown_code_is_refused():
    assert typed("line").document() == {"code": "other", "sub_volume": "", "layer": None, "text": "line"}
    with pytest.raises(ValueError, match="no_such"):
        Warning("no_such", "text")
