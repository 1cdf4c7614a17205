"""Equation 7: what is kept of the sample's Haar coefficients is what is matched and what is painted."""

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions
from upholster.codec.haar import dwt2, idwt2
from upholster.codec.stream.reader import StreamDecoder
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.image.files.material import Material
from upholster.image.files.write import write_image
from upholster.pipeline import cover, refine, write
from upholster.quilt.painting import paint
from upholster.synthesis.paper.coefficients import keep_coefficients
from upholster.synthesis.surface_request import kept_sample


def sample(height=64, width=72, channels=3, dtype="uint8"):
    rows, columns = np.mgrid[:height, :width]
    wave = 60 * np.sin(rows / 3) + 40 * np.cos(columns / 5)
    noise = np.random.default_rng(2).normal(size=(height, width, channels))
    picture = np.clip(120 + wave[:, :, None] + 15 * noise, 0, 255)
    return picture.astype("float32") / 255 if dtype == "float32" else np.rint(picture).astype(dtype)


def test_what_is_below_the_threshold_is_zero_and_the_rest_stays():
    image = sample(dtype="float32")
    kept = keep_coefficients(image, threshold=0.2)
    before, after = dwt2(image), dwt2(kept)
    small = np.abs(before) < 0.2
    assert 0.5 < small.mean() < 1
    assert np.abs(after[small]).max() < 1e-5
    np.testing.assert_allclose(after[~small], before[~small], atol=1e-5)


@pytest.mark.parametrize("share", [0.03, 0.15, 0.5, 1.0])
def test_a_share_keeps_the_largest_over_all_channels(share):
    image = sample()
    found = dwt2(image)
    count = round(share * image.size)
    least = np.sort(np.abs(found), axis=None)[-count]
    exact = np.clip(np.floor(idwt2(np.where(np.abs(found) >= least, found, 0)) + 0.5), 0, 255)
    kept = keep_coefficients(image, coefficients=share)
    np.testing.assert_array_equal(kept, exact)
    np.testing.assert_array_equal(kept, keep_coefficients(image, threshold=least))
    assert kept.dtype == np.uint8
    assert keep_coefficients(image) is image


def test_matching_sees_the_kept_coefficients_alone():
    image, surface = sample(), ring_cyclide()
    few = {"method": "paper", "chart": 64, "seed": 3}
    kept = keep_coefficients(image, coefficients=0.07)
    ours = synthesize(image, surface, coefficients=0.07, **few)
    np.testing.assert_array_equal(ours.placements, synthesize(kept, surface, **few).placements)
    whole = synthesize(image, surface, **few)
    assert (ours.placements["source_row"] != whole.placements["source_row"]).any()
    np.testing.assert_array_equal(synthesize(image, surface, threshold=0, **few).placements, whole.placements)


def test_every_map_of_a_material_loses_its_own_small_coefficients():
    maps = {"albedo": sample(), "roughness": sample(channels=1)}
    options = SynthesisOptions(method="paper", coefficients=0.05)
    kept = kept_sample(Material(maps), options)
    for role, image in maps.items():
        np.testing.assert_array_equal(kept.maps[role], keep_coefficients(image, coefficients=0.05))


def test_cover_paints_and_streams_what_is_kept(tmp_path):
    image = sample()
    write_image(tmp_path / "sample.png", image)
    targets = [str(tmp_path / name) for name in ("a.npz", "a.uph")]
    settings = {"method": "paper", "chart": 64, "coefficients": 0.07}
    exact = WriteOptions(sample_quality="lossless")
    cover(str(tmp_path / "sample.png"), "torus", targets, synthesis=settings, seed=1, options=exact)
    kept = keep_coefficients(image, coefficients=0.07)
    quilt = synthesize(kept, surface_from_spec("torus"), method="paper", chart=64, seed=1)
    painted = paint(quilt, kept)
    stored = np.load(tmp_path / "a.npz")
    found = [stored[name] for name in stored.files if stored[name].ndim == 3]
    for one, wanted in zip(found, painted.arrays, strict=True):
        np.testing.assert_array_equal(one, wanted)
    decoder = StreamDecoder()
    decoder.feed((tmp_path / "a.uph").read_bytes())
    np.testing.assert_array_equal(decoder.exemplar(), kept)


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
def test_a_stream_of_method_paper_has_the_papers_profile_and_keeps_it(tmp_path):
    write_image(tmp_path / "sample.png", sample())
    for name, synthesis, options, wanted in (
        ("a.uph", {"method": "paper", "chart": 64}, None, "haar"),
        ("b.uph", {"method": "paper", "chart": 64}, WriteOptions(wavelet="9/7"), "9/7"),
        ("c.uph", {"texels": 10_000}, None, "9/7"),
        ("d.uph", {"texels": 10_000}, WriteOptions(wavelet="haar"), "haar"),
    ):
        made, cut, again = (tmp_path / n for n in (name, f"cut_{name}", f"again_{name}"))
        cover(str(tmp_path / "sample.png"), "torus", [str(made)], synthesis=synthesis, options=options)
        data = made.read_bytes()
        cut.write_bytes(data[: 3 * len(data) // 4])
        refine(cut, [str(again)])
        for part in (data, again.read_bytes()):
            decoder = StreamDecoder()
            decoder.feed(part)
            assert decoder.complete
            assert decoder.wavelet == wanted


@pytest.mark.parametrize(
    ("choices", "reported"),
    [
        ({"method": "paper", "threshold": -1.0}, "threshold is -1; allowed: 0 or more"),
        ({"method": "paper", "threshold": float("nan")}, "threshold is nan"),
        ({"method": "paper", "coefficients": 0.0}, "coefficients is 0; allowed: above 0"),
        ({"method": "paper", "coefficients": 7.0}, "coefficients is 7; allowed: above 0, at most 1"),
        ({"method": "paper", "coefficients": 0.1, "threshold": 9.0}, "both given; allowed: one"),
        ({"threshold": 3.0}, "threshold belongs to method 'paper'"),
        ({"coefficients": 0.2}, "coefficients belongs to method 'paper'"),
    ],
)
def test_wrong_values_are_refused(choices, reported):
    with pytest.raises(InputError, match=reported):
        SynthesisOptions(**choices)


def test_options_of_streams_are_refused_where_none_is_written(tmp_path):
    write_image(tmp_path / "sample.png", sample())
    for options, name in (
        (WriteOptions(wavelet="haar"), "wavelet"),
        (WriteOptions(wavelet_levels=2), "wavelet_levels"),
        (WriteOptions(sample_quality="lossless"), "sample_quality"),
        (WriteOptions(stream_bytes=5000), "bytes"),
    ):
        with pytest.raises(InputError, match=rf"{name} is for \.uph and \.html, and .*a\.png is none"):
            cover(str(tmp_path / "sample.png"), "torus", [str(tmp_path / "a.png")], options=options)
    surface = surface_from_spec("plane")
    quilt = synthesize(sample(), surface, texels=5000)
    texels = paint(quilt, sample())
    with pytest.raises(InputError, match=r"sample_quality is for \.uph and \.html"):
        write(tmp_path / "a.glb", surface, texels, options=WriteOptions(sample_quality="lossless"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sample.png"]
