"""Projects in notebooks."""

import sys
from pathlib import Path

import pytest

from upholster import InputError, Project, Sample
from upholster.apps.notebook import LiveView

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def project():
    return Project("torus", Sample(str(EXAMPLES / "brick.png")), synthesis={"texels": 20_000})


@pytest.mark.slow(reason="covers a model again and again")
def test_the_view_follows_changes_and_sliders(project):
    pytest.importorskip("ipywidgets")
    view = project.view(height=300)
    assert isinstance(view, LiveView)
    view.wait()
    first = view._shown.value
    assert "<iframe" in first
    assert "height: 300px" in first
    view.change(seed=4)
    view.wait()
    assert view._shown.value != first
    seed, direction, width = view._box.children[0].children
    direction.value = 45.0
    view.wait()
    assert view.project.synthesis.direction == "45"
    width.value *= 2
    seed.value = 7
    view.wait()
    assert view.project.seed == 7
    assert view.project.synthesis.sample_size == pytest.approx(width.value)
    assert "application/vnd.jupyter.widget-view+json" in view._repr_mimebundle_()
    with pytest.raises(InputError, match="unknown option"):
        view.change(sede=3)


def test_without_widgets_it_is_shown_as_it_is(project, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    view = project.view()
    view.change(seed=2)
    shown = view._repr_mimebundle_()
    assert "<iframe" in shown["text/html"]
    assert "torus" in shown["text/plain"]
