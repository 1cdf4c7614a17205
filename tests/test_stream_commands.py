"""encode, decode, refine, info and levels as a user meets them."""

import math
import os
import re

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.errors import FormatError, InputError
from upholster.base.options.write_options import WriteOptions
from upholster.codec.ezw import decode, encode
from upholster.codec.stream.prefix import Limit, feed_until
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.image.drawing import Drawing
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.output.levels import curve_picture, levels_picture, refine_steps, share_text
from upholster.pipeline import refine


def sample():
    rows, columns = np.mgrid[:64, :64]
    wave = np.sin(rows / 3) + np.cos(columns / 5)
    noise = np.random.default_rng(0).normal(size=(64, 64, 3))
    return np.clip(128 + 40 * wave[:, :, None] + 12 * noise, 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def parts():
    exemplar, surface = sample(), upholster.torus(3, 1)
    quilt = upholster.synthesize(exemplar, surface, chart=64, seed=3, method="paper")
    return exemplar, surface, quilt, encode_stream(surface, quilt, exemplar)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, parts):
    folder = tmp_path_factory.mktemp("streams")
    write_image(folder / "sample.png", parts[0])
    (folder / "ring.uph").write_bytes(parts[3])
    (folder / "cut.uph").write_bytes(parts[3][:1000])
    (folder / "short.uph").write_bytes(parts[3][:20])
    (folder / "bad.uph").write_bytes(parts[3][:900] + b"\xff" + parts[3][901:])
    (folder / "notes.uph").write_text("these are notes")
    return folder


@pytest.mark.parametrize(
    "command", [("refine", "-o", "ring.npz"), ("info",), ("levels", "-o", "ring.png"), ("measure",)]
)
def test_every_command_that_reads_a_stream_takes_a_limit(folder, command):
    done = run_cli(command[0], "ring.uph", *command[1:], "--limit", "1k", cwd=folder)
    assert_one_line(done, "ring.uph")
    assert "texels; allowed here: 1000" in done.stderr
    assert not {"ring.npz", "ring.png"} & set(os.listdir(folder))


def test_cover_and_refine_agree(folder, tmp_path, parts):
    done = run_cli(
        "cover", "sample.png", "--on", "torus:R=3,r=1", "--method", "paper", "--chart", "64", "--seed", "3",
        "-o", str(tmp_path / "ring.uph"), "-o", str(tmp_path / "direct.npz"), "--sample-quality", "lossless",
        cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    done = run_cli("refine", str(tmp_path / "ring.uph"), "-o", str(tmp_path / "again.npz"), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "complete" in done.stdout
    assert "incomplete" not in done.stdout
    direct, again = np.load(tmp_path / "direct.npz"), np.load(tmp_path / "again.npz")
    for name in direct.files:
        np.testing.assert_array_equal(direct[name], again[name])


def test_a_cut_file_works_and_says_so(folder, tmp_path):
    names = ["a.glb", "a.png", "a.obj", "a.uph"]
    done = run_cli(
        "refine", "cut.uph", "--size", "64x48", *[f"-o{tmp_path / name}" for name in names], cwd=folder
    )
    assert done.returncode == 0, done.stderr
    assert "1.0 kB" in done.stdout
    assert "incomplete" in done.stdout
    assert all((tmp_path / name).stat().st_size for name in names)


def test_info_tells_the_chunks(folder):
    for name, state in (("ring.uph", "complete"), ("cut.uph", "incomplete")):
        done = run_cli("info", name, cwd=folder)
        assert done.returncode == 0, done.stderr
        assert state in done.stdout
        assert "exemplar" in done.stdout
        assert "1,000" in done.stdout


@pytest.mark.slow(reason="covers several models, or one several times")
def test_levels_and_curve_are_pictures(folder, tmp_path):
    for name, option in (("levels.png", "--size=80x60"), ("curve.jpg", "--curve")):
        done = run_cli("levels", "ring.uph", "-o", str(tmp_path / name), option, cwd=folder)
        assert done.returncode == 0, done.stderr
        assert read_image(tmp_path / name).std() > 5


@pytest.mark.slow(reason="covers several models, or one several times")
def test_images_through_the_codec(folder, tmp_path):
    original = read_image(folder / "sample.png")
    coded, back = tmp_path / "sample.ezw", tmp_path / "back.png"
    for options, check in (
        (["--sample-quality", "lossless"], lambda image: (image == original).all()),
        ([], lambda image: 46 <= psnr(image, original) < 47),
        (["--bytes", "1k"], lambda image: coded.stat().st_size == 1000),
        (["--bpp", "1"], lambda image: coded.stat().st_size == 512),
        (["--sample-quality", "30"], lambda image: 30 <= psnr(image, original) < 30.2),
        (
            ["--coefficients", "15%", "--wavelet", "haar", "--levels", "3"],
            lambda image: image.shape == (64, 64, 3),
        ),
    ):
        done = run_cli("encode", "sample.png", "-o", str(coded), *options, cwd=folder)
        assert done.returncode == 0, done.stderr
        done = run_cli("decode", str(coded), "-o", str(back), cwd=folder)
        assert done.returncode == 0, done.stderr
        assert check(read_image(back)), options


def test_bytes_behind_the_end_are_refused():
    data = encode(sample(), sample_quality="lossless")
    assert decode(data).complete
    assert (decode(data).image == sample()).all()
    with pytest.raises(FormatError, match=f"byte {len(data)}: 3 bytes too many"):
        decode(data + b"end")


def psnr(image, original):
    return 10 * math.log10(255**2 / np.mean((image.astype(float) - original) ** 2))


@pytest.mark.parametrize(
    "arguments",
    [
        ["refine", "none.uph", "-o", "a.glb"],
        ["refine", "notes.uph", "-o", "a.glb"],
        ["refine", "short.uph", "-o", "a.glb"],
        ["refine", "bad.uph", "-o", "a.glb"],
        ["refine", "ring.uph", "-o", "a.xyz"],
        ["refine", "ring.uph", "-o", "a.glb", "--bytes", "many"],
        ["refine", "ring.uph", "-o", "a.glb", "--bytes", "0"],
        ["refine", "ring.uph", "-o", "a.glb", "--coefficients", "140%"],
        ["refine", "ring.uph", "-o", "a.glb", "--bytes", "4k", "--bpp", "1"],
        ["refine", ".", "-o", "a.glb"],
        ["info", "none.uph"],
        ["info", "short.uph"],
        ["levels", "ring.uph", "-o", "a.glb"],
        ["levels", "short.uph", "-o", "a.png"],
        ["encode", "sample.png", "-o", "a.png"],
        ["encode", "none.png", "-o", "a.ezw"],
        ["encode", "sample.png", "-o", "a.ezw", "--bytes", "10"],
        ["encode", "sample.png", "-o", "a.ezw", "--wavelet", "db4"],
        ["encode", "sample.png", "-o", "a.ezw", "--sample-quality", "lossless", "--wavelet", "9/7"],
        ["encode", "sample.png", "-o", "a.ezw", "--levels", "11"],
        ["encode", "sample.png", "-o", "a.ezw", "--sample-quality", "-3"],
        ["encode", "sample.png", "-o", "a.ezw", "--sample-quality", "nan"],
        ["decode", "sample.png", "-o", "a.png"],
        ["decode", "ring.uph", "-o", "a.png"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.uph", "--bytes", "1"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.uph", "--wavelet", "db4"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.uph", "--threshold", "1"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.png", "--coefficients", "7%"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.uph", "--method", "paper", "--threshold=-1"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.uph", "--method", "paper", "--coefficients", "0"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.png", "-o", "a.glb", "--wavelet", "haar"],
        ["cover", "sample.png", "--on", "torus", "-o", "a.png", "--bytes", "8k"],
        [
            "cover",
            "sample.png",
            "--on",
            "torus",
            "-o",
            "a.uph",
            "--sample-quality",
            "lossless",
            "--wavelet",
            "9/7",
        ],
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, folder):
    before = sorted(folder.iterdir())
    assert_one_line(run_cli(*arguments, cwd=folder))
    assert sorted(folder.iterdir()) == before


def test_limits_stop_where_they_say(parts):
    data = parts[3]
    for limit, reached in (
        (Limit(most_bytes=1500), lambda d: d.received == 1500),
        (Limit(bits_per_pixel=2), lambda d: 1024 <= d.received < 1100),
        (
            Limit(coefficients=0.07),
            lambda d: 0.07 <= d.coefficients_known[0] / d.coefficients_known[1] < 0.09,
        ),
        (Limit(most_bytes=1), lambda d: d.needed == 0 and d.received < 100),
        (Limit(), lambda d: d.complete),
    ):
        decoder = StreamDecoder()
        feed_until(decoder, data, limit)
        assert reached(decoder), limit
    for wrong in ({"most_bytes": 1, "coefficients": 0.5}, {"most_bytes": 0}, {"bits_per_pixel": math.nan}):
        with pytest.raises(InputError):
            Limit(**wrong)


def test_every_further_byte_helps(parts):
    data = parts[3]
    steps = refine_steps(data, [Limit(coefficients=share) for share in (0.03, 0.05, 0.07, 0.15, 1)])
    lengths, qualities = [step.length for step in steps], [step.psnr for step in steps]
    assert lengths == sorted(set(lengths))  # each share takes bytes of its own
    # A limit in coefficients waits for all placements.
    assert [step.charts for step in steps] == [1.0] * len(steps)
    assert qualities == sorted(qualities)
    assert qualities[-1] == math.inf
    assert [step.complete for step in steps] == [False, False, False, False, True]
    for step, share in zip(steps, (0.03, 0.05, 0.07, 0.15), strict=False):
        assert share <= step.coefficients < share + 8 / parts[0].size
    assert steps[-1].coefficients > 0.15


def test_a_share_tells_the_bytes_that_it_takes(parts):
    exemplar, surface, quilt, _ = parts
    # The sample comes first, so that every share is read to the end for its placements.
    data = encode_stream(surface, quilt, exemplar, first_part=100_000)
    steps = refine_steps(data, [Limit(coefficients=share) for share in (0.03, 0.05, 0.07, 0.15, 1)])
    lengths = [step.length for step in steps]
    assert (np.diff(lengths) > 40).all()
    assert lengths[-1] == len(data)


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("wavelet", ["9/7", "haar"])
def test_a_limit_in_coefficients_has_all_placements(parts, wavelet):
    exemplar, surface, quilt, _ = parts
    for first_part in (600, 5000):
        data = encode_stream(surface, quilt, exemplar, wavelet=wavelet, first_part=first_part)
        one = StreamDecoder()
        for share in (0.01, 0.4):
            feed_until(one, data, Limit(coefficients=share))
            assert one.placements_complete
            assert not one.complete
            known, count = one.coefficients_known
            assert share * count <= known < share * count + 8
            # Rising limits with one decoder are as good as one limit at once.
            other = StreamDecoder()
            feed_until(other, data, Limit(coefficients=share))
            np.testing.assert_array_equal(one.exemplar(), other.exemplar())
            np.testing.assert_array_equal(one.quilt().placements, quilt.placements)
            # It takes as many bytes as a stream that ends there, but for what is round its chunks.
            alone = encode_stream(
                surface,
                quilt,
                exemplar,
                wavelet=wavelet,
                first_part=first_part,
                most_significant=round(share * count),
            )
            assert one.used == pytest.approx(len(alone), abs=120)
        one.limit_coefficients(None)
        one.feed(data[one.received :])
        assert one.complete
        whole = StreamDecoder()
        whole.feed(data)
        np.testing.assert_array_equal(one.exemplar(), whole.exemplar())


def test_shares_are_never_rounded_up_to_all():
    reported = {0.03: "3 %", 0.0701: "7 %", 0.1502: "15 %", 0.684: "68 %", 0.9999: "99.9 %", 1.0: "100 %"}
    assert {share: share_text(share) for share in reported} == reported


def test_levels_picture_shows_as_many_models_as_levels(parts):
    options = WriteOptions(size=(60, 40), quads=400)
    picture = levels_picture(parts[3], options=options)
    assert picture.shape == (40 + 24 + 48, 5 * 72 + 12, 3)
    plotted, steps = curve_picture(parts[3])
    assert plotted.shape[2] == 3
    assert [step.length for step in steps] == sorted({step.length for step in steps})
    # The line never falls, though the first details, of a sample that is only repeated, lie elsewhere.
    line = [int(np.argmax(column)) for column in (plotted[:420, 90:730] == (26, 89, 178)).all(axis=2).T]
    assert max(line) > min(line) > 0
    assert line == sorted(line, reverse=True)
    with pytest.raises(InputError, match="more bytes"):
        levels_picture(parts[3][:20])


def test_refine_says_which_part_of_a_damaged_stream_is_good(folder, tmp_path):
    data = (folder / "ring.uph").read_bytes()
    for chunk in upholster.codec.stream.reader.read_stream(data).chunks:
        (tmp_path / "bad.uph").write_bytes(
            data[: chunk.end - 1] + bytes([data[chunk.end - 1] ^ 1]) + data[chunk.end :]
        )
        with pytest.raises(FormatError, match=f"^byte {chunk.offset}: chunk '{chunk.tag}' has CRC") as error:
            refine(tmp_path / "bad.uph", [str(tmp_path / "a.npz")])
        assert not (tmp_path / "a.npz").exists()
        usable = re.search(r"its first (\d+) bytes are right and show a model: --bytes \1$", str(error.value))
        if chunk.tag in "SLX":
            assert usable is None
        else:
            assert usable is not None
            assert int(usable[1]) == chunk.offset
            report = refine(
                tmp_path / "bad.uph", [str(tmp_path / "a.npz")], limit=Limit(most_bytes=chunk.offset)
            )
            assert report.used == chunk.offset
            (tmp_path / "a.npz").unlink()


def test_a_whole_stream_is_written_again_as_it_is(folder, tmp_path):
    data = (folder / "ring.uph").read_bytes()
    again, cut = tmp_path / "again.uph", tmp_path / "cut.uph"
    report = refine(folder / "ring.uph", [str(again)])
    assert again.read_bytes() == data
    assert (report.complete, report.placements, report.coefficients) == (True, 1, 1)
    report = refine(folder / "ring.uph", [str(cut)], limit=Limit(most_bytes=len(data) // 2))
    assert report.coefficients < 1
    assert cut.read_bytes() != data[: len(data) // 2]  # whole in itself
    refine(folder / "ring.uph", [str(cut)], options=WriteOptions(wavelet="haar"))
    assert cut.read_bytes() != data


def test_write_needs_the_quilt_for_a_stream(tmp_path, parts):
    exemplar, surface, quilt, _ = parts
    texels = upholster.paint(quilt, exemplar)
    alone = upholster.Texels(texels.charts, texels.arrays)
    with pytest.raises(InputError, match="quilt"):
        upholster.write(tmp_path / "a.uph", surface, alone)
    upholster.write(tmp_path / "a.uph", surface, alone, quilt=quilt, exemplar=exemplar)
    decoder = StreamDecoder()
    decoder.feed((tmp_path / "a.uph").read_bytes())
    assert decoder.complete
    np.testing.assert_array_equal(decoder.quilt().placements, quilt.placements)


def test_drawing_puts_things_where_they_are_asked():
    drawing = Drawing(60, 40)
    drawing.paste(10, 5, np.zeros((4, 3, 3), np.uint8))
    drawing.lines([(20.0, 30.0), (50.0, 30.0)], color=(1.0, 0.0, 0.0), width=3)
    pixels = drawing.pixels()
    assert (pixels[5:9, 10:13] == 0).all()
    assert (pixels[29:32, 25:45] == (255, 0, 0)).all()
    assert (pixels[20, 20] == 255).all()
    drawing.text(30, 20, "M", size=14)
    assert (drawing.pixels()[10:21, 22:38] < 100).any()
