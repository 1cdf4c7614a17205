"""The studio's worker process: it holds the project, shows it while it changes, and saves it.

Messages are tuples over a pipe. In: ``(number, name, arguments)``. Out: ``("answer", number, value)`` or
``("error", number, words)``. And the messages of a revision: ``("stage", revision, name, done, total)``,
``("look", revision, is_final, seconds, streams)``, ``("facts", revision, facts)``,
``("failed", revision, words)``, ``("ended", revision)``.
"""

import os
import shutil
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from upholster.apps.project.file import project_data, project_of, read_project, save_project
from upholster.apps.project.preview import Look, Preview, Previews
from upholster.apps.project.project import Project
from upholster.apps.studio import words
from upholster.apps.studio.folder import file_kind
from upholster.apps.studio.model_picture import model_picture
from upholster.apps.studio.overlays import segments
from upholster.apps.studio.uncovered import plain_streams
from upholster.apps.studio.words import flat
from upholster.base.errors import CancelledError, InputError, UpholsterError
from upholster.base.formats import kind_of, split_name
from upholster.base.lengths import METRES
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import FloatArray
from upholster.codec.stream.sample import fitting_side
from upholster.codec.stream.writer import encode_stream
from upholster.covering.joint_work import automatic_values, read_notes, roles_of, work_notes
from upholster.covering.request import Request
from upholster.geometry.meshes.rays import first_hit
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.image.color import from_linear, to_linear
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.source import Sample, read_source, source_parts
from upholster.image.files.write import encode_image
from upholster.image.photo.even_light import UNEVEN, light_range
from upholster.image.photo.perspective import proposed_corners
from upholster.image.photo.preparation import resampled
from upholster.quilt.model import Quilt

__all__ = ["serve_pipe"]

_LOOK = 10_000
"""Number of texels that Python paints for a look: the page paints its own."""

_HERE = "files that were dropped here"

_SHOWN = 4
"""Number of recent looks that can still be saved."""

_QUIET = 0.1
"""Seconds between two progress messages of the same stage."""


def serve_pipe(pipe: Connection, folder: str, most_bytes: int) -> None:
    """Serve a pipe until it is closed: the process's main function."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (most_bytes, most_bytes))
    work = _Work(pipe, Path(folder))
    with suppress(EOFError, KeyboardInterrupt):
        while True:
            number, name, arguments = pipe.recv()
            threading.Thread(target=work.answer, args=(number, name, arguments), daemon=True).start()


class _Work:
    """The current project, and what was shown of it."""

    def __init__(self, pipe: Connection, folder: Path) -> None:
        self.pipe, self.folder = pipe, folder
        self.lock = threading.Lock()
        self.changing = threading.Lock()
        self.previews = Previews()
        self.project: Project | None = None
        self.revision = 0
        self.shown: dict[int, Project] = {}
        self.left: tuple[object, Sequence[bytes]] = (None, ())

    def send(self, *message: Any) -> None:
        with self.lock, suppress(OSError):
            self.pipe.send(message)

    def answer(self, number: int, name: str, arguments: tuple[Any, ...]) -> None:
        known: dict[str, Callable[..., Any]] = {
            "state": self.state,
            "source": self.source,
            "picture": self.picture,
            "prepared": self.prepared,
            "hints": self.hints,
            "pick": self.pick,
            "save": self.save,
            "overlay": self.overlay,
        }
        try:
            self.send("answer", number, known[name](*arguments))
        except UpholsterError as error:
            self.send("error", number, self.shortened(str(error)))
        except MemoryError:
            self.send("error", number, "this takes more memory than the studio allows")
        except Exception as error:
            print(f"upholster: {name} failed: {type(error).__name__}: {error}", file=sys.stderr)
            self.send("error", number, "an internal error occurred; see the terminal for details")

    def shortened(self, text: str) -> str:
        """Return an error's text with the page's names of files."""
        text = text.replace(f"{self.folder}{os.sep}", "")
        return text.replace(f"files in the folder {str(self.folder)!r}, and in those of --allow DIR", _HERE)

    # -------------------------------------------------------------- what is shown

    def state(self, written: Any, revision: int) -> dict[str, Any]:
        """Begin to show a state; the previous one is cancelled. One without model or sample shows nothing."""
        project: Project | None = None
        notes: list[str] = []
        if _is_complete(written):
            project = replace(project_of(written, self.folder), previews=self.previews)
            project, notes = self.fitted(project)
        with self.changing:
            if revision < self.revision:
                raise CancelledError("a later change replaced it")
            self.project, self.revision = project, revision
            if project is None:
                self.previews.cancel()
                self.send("ended", revision)
                return {"revision": revision}
            stage = _Stages(lambda *said: self.send("stage", revision, *said))
            preview = project.preview(texels=_LOOK, progress=stage)
        threading.Thread(target=self.follow, args=(revision, project, preview), daemon=True).start()
        return {
            "revision": revision,
            "name": words.stem(project),
            "command": words.command(project, self.folder),
            "python": words.python(project, self.folder),
            "notes": [*project.notes, *notes],
        }

    def fitted(self, project: Project) -> tuple[Project, list[str]]:
        """Return a project whose samples fit in the page's streams, and a note for each that was reduced."""
        notes: list[str] = []

        def fitting(sample: Sample) -> Sample:
            with self.previews.stages.active():
                parts = source_parts(read_source(sample, notes=[]))
            if (side := fitting_side(parts.values())) is None:
                return sample
            resized = replace(sample, options=replace(sample.options, resize=side))
            notes.append(
                f"{words.file_names(sample)[0]} has more pixels than the page can show, so it is reduced to "
                f"{side} pixels on its longer side (--resize {side})"
            )
            return resized

        found = replace(
            project,
            sample=None if project.sample is None else fitting(project.sample),
            materials={part: fitting(one) for part, one in project.materials.items()},
        )
        return found, list(dict.fromkeys(notes))

    def follow(self, revision: int, project: Project, preview: Preview) -> None:
        """Send a preview's looks."""
        try:
            for look in preview:
                with self.previews.stages.active():
                    requests = project.request().read()
                    streams = [*_streams(requests, look), *self.uncovered(project, requests)]
                if preview.is_cancelled:
                    break
                if look.is_final:
                    self.shown = {**dict(list(self.shown.items())[1 - _SHOWN :]), revision: project}
                self.send("look", revision, look.is_final, look.seconds, streams)
                self.send("facts", revision, self.facts(project))
        except CancelledError:
            pass
        except UpholsterError as error:
            self.send("failed", revision, self.shortened(str(error)))
        except MemoryError:
            self.send("failed", revision, "this takes more memory than the studio allows")
        except Exception as error:
            print(f"upholster: the preview failed: {type(error).__name__}: {error}", file=sys.stderr)
            self.send("failed", revision, "an internal error occurred; see the terminal for details")
        self.send("ended", revision)

    def facts(self, project: Project) -> dict[str, Any]:
        """Return facts about model and sample."""
        with self.previews.stages.active():
            requests = project.request().read()
            first = requests[0]
            model, scale = first.covered.model, first.scene.scale
            found: dict[str, Any] = {
                "sample_size": None if scale is None else scale.sample_size,
                "texels": sum(each.texels for each in requests),
                "settled": automatic_values(requests),
                "notes": [*read_notes(requests), *work_notes(requests)],
                "parts": [],
                "unit": None,
                "heights": _has_heights(requests),
            }
            if model is None:
                return found
            whole = self.whole_model(project)
            counts = np.bincount(whole.mesh.part, minlength=len(whole.parts))
            found["parts"] = [
                {"name": part.name, "material": part.material, "triangles": int(count)}
                for part, count in zip(whole.parts, counts, strict=True)
            ]
            found["unit"] = None if whole.mesh.metres is None else _unit_name(whole.mesh.metres)
        return found

    def uncovered(self, project: Project, requests: Sequence[Request]) -> Sequence[bytes]:
        """Return streams of the parts that no sample covers, in the colours of the file."""
        model = requests[0].covered.model
        if model is None or not model.left:
            return ()
        key = (str(project.model), replace(project.reading, part=None), model.left)
        if self.left[0] != key:
            self.left = key, plain_streams(self.whole_model(project), model.left)
        return self.left[1]

    def whole_model(self, project: Project) -> Any:
        """Return the model of the file, with all of its parts."""
        whole = replace(project.reading, part=None)
        with self.previews.stages.active():
            found = replace(project, reading=whole, materials={}, sample=project.sample or _any(project))
            return found.request().read()[0].covered.model

    def pick(self, origin: Sequence[float], direction: Sequence[float]) -> dict[str, Any]:
        """Return the part that a ray hits first."""
        project = self.project
        if project is None or (model := self.whole_model(project)) is None:
            return {"part": None}
        mesh = model.mesh
        hit = first_hit(mesh.positions, mesh.triangles, _vector(origin), _vector(direction))
        if hit is None:
            return {"part": None}
        triangle, point = hit
        return {"part": model.parts[int(model.mesh.part[triangle])].name, "point": list(point)}

    def overlay(self, kind: str) -> bytes:
        """Return line segments, float32: where charts meet, or the direction of rows."""
        project = self.project
        if project is None:
            return b""
        with self.previews.stages.active():
            found = [segments(each, kind) for each in project.request().read()]
        return np.concatenate(found).astype("<f4").tobytes()

    # -------------------------------------------------------------- samples

    def source(self, path: str) -> dict[str, Any]:
        """Return the kind and contents of a source, or the state of a project's file."""
        if path.endswith(".json"):
            project = read_project(str(self.folder / path))
            return {
                "kind": "project",
                "state": project_data(project, self.folder),
                "notes": list(project.notes),
            }
        with self.previews.stages.active():
            parts = source_parts(read_source(str(self.folder / path)))
        height, width = parts["albedo"].shape[:2]
        kind = "material" if len(parts) > 1 else "image"
        return {"kind": kind, "roles": list(parts), "width": width, "height": height}

    def picture(self, path: str, size: int, role: str) -> tuple[bytes, int, int]:
        """Return a PNG of a model, or of a source's map as it is read, and the map's own size."""
        if file_kind(path) == "model":
            with self.previews.stages.active():
                return model_picture(str(self.folder / path), size)
        with self.previews.stages.active():
            parts = source_parts(read_source(str(self.folder / path)))
        return _png(parts.get(role, parts["albedo"]), size)

    def prepared(self, path: str, options: dict[str, Any], size: int) -> tuple[bytes, int, int, list[float]]:
        """Return a PNG of a sample read with options, its own size, and the size of its repeating element.

        The element's size is its width and height in pixels, the distance of rows alone, or nothing.
        """
        written = {"upholster": 1, "model": "plane", "sample": {"source": path, **options}}
        sample = project_of(written, self.folder).sample
        assert sample is not None
        with self.previews.stages.active():
            pixels = source_parts(read_source(sample))["albedo"]
            lattice = find_lattice(pixels)
        return *_png(pixels, size), [] if lattice is None else list(lattice.element)

    def hints(self, path: str) -> dict[str, Any]:
        """Return suggestions for a photo: corners of a rectangle if certain, and how uneven its light is."""
        with self.previews.stages.active():
            pixels = source_parts(read_source(str(self.folder / path)))["albedo"]
        return {"corners": proposed_corners(pixels), "light": light_range(pixels), "uneven": UNEVEN}

    # -------------------------------------------------------------- saving

    def save(self, revision: int, targets: Sequence[str], depth: str | None) -> dict[str, Any]:
        """Write files of the model shown into a folder of their own.

        `depth` is that of the relief in files for printers; "": they are flat; None: as the project has it.
        """
        project = self.shown.get(revision)
        if project is None:
            raise CancelledError("the model has changed in the meantime; save again")
        with self.changing:
            saved = self.folder / "saved"
            saved.mkdir(exist_ok=True)
            before = [int(one) for one in os.listdir(saved) if one.isdigit()]  # an earlier worker's too
            number = 1 + max(before, default=0)
            folder = saved / str(number)
            folder.mkdir()
        notes: list[str] = []
        for target in targets:
            if target == "project":
                _save_project(project, folder)
            else:
                prefix, place = split_name(target)
                kind = kind_of(prefix, place)
                relief = self.in_relief(project, depth) if kind and kind.solid else flat(project)
                notes += relief.cover([f"{prefix}{folder / os.path.basename(place)}"]).notes
        files = sorted(one for one in folder.iterdir() if one.is_file())
        listed = [{"name": one.name, "bytes": one.stat().st_size} for one in files]
        return {"id": number, "files": listed, "notes": notes}

    def in_relief(self, project: Project, depth: str | None) -> Project:
        """Return a project whose files for printers have a relief of this depth."""
        if depth is None:
            return project
        if not depth:
            return flat(project)
        with self.previews.stages.active():
            heights = _has_heights(project.request().read())
        own = {} if heights or project.writing.displace is not None else {"displace_by": "luminance"}
        return project.change(displace=depth, **own)


class _Stages:
    """Reports stages as they begin, and the progress within one from time to time."""

    def __init__(self, say: Callable[[str, int, int], None]) -> None:
        self.say, self.last, self.time = say, "", 0.0

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = time.perf_counter()
        if stage == self.last and now - self.time < _QUIET:
            return
        self.last, self.time = stage, now
        self.say(stage, done, total)


def _has_heights(requests: Sequence[Request]) -> bool:
    """Return whether all samples have a height map."""
    return "height" in roles_of(requests, all_have=True)


def _is_complete(written: Any) -> bool:
    """Return whether a state has enough to show, or is none at all: then `project_of` says so."""
    return not isinstance(written, dict) or bool(
        written.get("model") and (written.get("sample") or written.get("materials"))
    )


def _vector(numbers: Any) -> FloatArray:
    try:
        return np.array(numbers, float)
    except (TypeError, ValueError):
        raise InputError(f"a ray has {str(numbers)[:40]!r}; allowed: three numbers") from None


def _any(project: Project) -> Sample:
    return next(iter(project.materials.values()))


def _unit_name(metres: float) -> str | None:
    return next((name for name, size in METRES.items() if abs(size - metres) < 1e-9 * metres), None)


def _streams(requests: Sequence[Request], look: Look) -> list[bytes]:
    """Return a look as streams, one for each sample: its own triangles; the first also has the plain ones."""
    if len(requests) == 1:
        return [_stream(requests[0], requests[0].surface, look.quilts[0])]
    surfaces = [each.surface for each in requests if isinstance(each.surface, MeshSurface)]
    plain = np.all([surface.island < 0 for surface in surfaces], axis=0)
    streams = []
    for n, (request, surface, quilt) in enumerate(zip(requests, surfaces, look.quilts, strict=True)):
        kept = (surface.island >= 0) | (plain if n == 0 else False)
        mesh = TriangleMesh(surface.mesh.positions, surface.mesh.triangles[kept])
        own = MeshSurface(mesh, surface.island[kept], surface.parameters[kept])
        streams.append(_stream(request, own, replace(quilt, surface=own)))
    return streams


def _stream(request: Request, surface: Any, quilt: Quilt) -> bytes:
    parts = source_parts(request.source)
    return encode_stream(surface, quilt, parts.pop("albedo"), maps=parts, **WriteOptions().transform)


def _png(pixels: Any, size: int) -> tuple[bytes, int, int]:
    """Return an image with its longer side at most `size`, and its own width and height."""
    height, width = pixels.shape[:2]
    longer = max(height, width)
    if longer > size:
        small = {"height": max(1, height * size // longer), "width": max(1, width * size // longer)}
        pixels = resampled("albedo", pixels, **small)
    shown = pixels if pixels.dtype == np.uint8 else from_linear(to_linear(pixels), "uint8")
    return encode_image(shown[..., :4], "png"), width, height


def _save_project(project: Project, folder: Path) -> None:
    """Write a zip of a project's file and the files that it needs."""
    name = words.stem(project)
    with tempfile.TemporaryDirectory(dir=folder.parent) as own:
        save_project(project, Path(own) / f"{name}.upholster.json")
        with zipfile.ZipFile(folder / f"{name}.zip", "w", zipfile.ZIP_DEFLATED) as file:
            for one in sorted(Path(own).rglob("*")):
                if one.is_file():
                    file.write(one, one.relative_to(own))
    shutil.rmtree(own, ignore_errors=True)
