"""Reading a stream, from its first bytes on."""

import numpy as np

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import FormatError, InputError, nearest
from upholster.base.limits import Limits
from upholster.base.types import PixelArray
from upholster.codec.header import ImageHeader
from upholster.codec.partial_image import ImageDecoder
from upholster.codec.stream.base_chunk import MOST_BASES, Base, parse_base
from upholster.codec.stream.budget import check_cell_budget, check_chart_budget, check_sample_budget
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.chunks import CHUNK_KINDS, Chunk, ChunkReader
from upholster.codec.stream.field_chunks import FieldDecoder
from upholster.codec.stream.layout_chunk import parse_layout
from upholster.codec.stream.maps import FIRST_ROLE, MAX_MAP_SAMPLES, MOST_SIDE, parse_role
from upholster.codec.stream.plan import PlanDecoder
from upholster.codec.stream.plan_head import PlanHead
from upholster.codec.stream.surface_chunk import parse_surface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.materials import paint_map
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import painted_charts
from upholster.runtime.parallel import running

__all__ = ["StreamDecoder", "read_stream"]

_CAUTION = 64
"""A byte rarely codes more coefficients than this. Within this distance of a coefficient limit, bytes are
read one at a time."""


class StreamDecoder(Shown):
    """Decodes a .uph stream as its bytes arrive; the work is proportional to the new bytes.

    As soon as no bytes are `needed`, there is a complete model, at first in the sample's mean colour; every
    further byte refines it.

    Parameters
    ----------
    limits
        Limits of the stream's demands; by default `Limits()`. A stream that exceeds one is refused.

    Attributes
    ----------
    surface
        The surface, a `MeshSurface` if it is a mesh; while few of its placements are known, the last
        base that has arrived; None before that.
    charts
        The layout of `surface`; empty before it has arrived.
    """

    def __init__(self, *, limits: Limits | None = None) -> None:
        if not isinstance(limits, Limits | None):
            raise InputError(f"limits is a {type(limits).__name__}; allowed: Limits")
        self._limits = limits or Limits()
        self.surface: Surface | MeshSurface | None = None
        self.charts: tuple[Chart, ...] = ()
        self._base: Base | None = None  # until the surface has some placements
        self._exact: Surface | MeshSurface | None = None
        self._layout: tuple[Chart, ...] = ()
        self._reader = ChunkReader()
        self._image: ImageDecoder | None = None
        self._plan: PlanDecoder | None = None
        self._maps: dict[str, ImageDecoder] = {}
        self._fed: ImageDecoder | None = None  # decoder of the current chunk E
        self._share: float | None = None
        self._held = bytearray()  # bytes of the exemplar beyond that share
        self._fields: FieldDecoder | None = None
        self._whole = bytearray()
        self._seen = ""
        self._verified = 0
        self._failure: str | None = None

    def __repr__(self) -> str:
        parts: dict[str, object] = {"received": self.received, "total": self.total}
        if self.needed:
            return on_a_line(self, {**parts, "needed": self.needed})
        return on_a_line(self, {**parts, "charts": len(self.charts), "complete": self.complete})

    @property
    def received(self) -> int:
        """Number of bytes fed so far."""
        return self._reader.received

    @property
    def used(self) -> int:
        """Number of bytes fed so far, without those of the exemplar that are held back."""
        return self.received - len(self._held)

    @property
    def total(self) -> int | None:
        """Length of the whole file, from its header; None before the header has arrived."""
        return self._reader.total

    @property
    def needed(self) -> int:
        """Number of missing bytes until something can be shown, then 0."""
        if self._image is not None:
            return 0
        # Before the header has arrived: at least the rest of the shortest one.
        return max(1, (self._reader.view or 6) - self.received)

    @property
    def is_base(self) -> bool:
        """Whether `surface` is the base, a coarse mesh: few placements on the surface itself are known."""
        return self._base is not None

    @property
    def complete(self) -> bool:
        """Whether the whole file has arrived, every chunk's CRC is right, and no byte is held back."""
        return self._reader.complete and not self._held

    @property
    def chunks(self) -> tuple[Chunk, ...]:
        """The chunks that have begun."""
        return tuple(self._reader.chunks)

    @property
    def verified(self) -> int:
        """Number of bytes at the start of the stream whose chunks are complete and right."""
        return self._verified

    @property
    def placements_known(self) -> tuple[int, int]:
        """Number of known placements, and of all; (0, 0) before the plan has arrived."""
        return (0, 0) if self._plan is None else (self._plan.known, self._plan.total)

    @property
    def labels_known(self) -> tuple[int, int]:
        """Number of cells with known labels, and with coded ones; (0, 0) before the plan has arrived."""
        return (0, 0) if self._plan is None else (self._plan.known_cells, self._plan.total_cells)

    @property
    def density(self) -> float:
        """Density of painting in texels per step of the charts, each way; 1 before the plan has arrived."""
        return 1.0 if self._shown_plan is None else self._shown_plan.density

    @property
    def charts_known(self) -> int:
        """Number of charts that have a placement of their own; the others show the middle of the exemplar."""
        return 0 if self._shown_plan is None else self._shown_plan.charts_known

    @property
    def _shown_plan(self) -> PlanDecoder | None:
        return None if self.is_base else self._plan

    @property
    def placements_complete(self) -> bool:
        """Whether all placements and labels are known."""
        return self._plan is not None and self._plan.complete

    @property
    def plan_known(self) -> bool:
        """Whether the number of placements is known."""
        return self._plan is not None

    @property
    def exemplar_shape(self) -> tuple[int, int, int]:
        """(H, W, C) of the exemplar; raises InputError while bytes are still `needed`."""
        header = self._ready().header
        return header.height, header.width, header.channels

    @property
    def exemplar_dtype(self) -> np.dtype[np.generic]:
        """The exemplar's dtype; raises InputError while bytes are still `needed`."""
        return self._ready().header.dtype

    @property
    def wavelet(self) -> str:
        """The exemplar's wavelet; raises InputError while bytes are still `needed`."""
        return self._ready().header.wavelet

    @property
    def coefficients_known(self) -> tuple[int, int]:
        """Number of significant coefficients of the exemplar so far, and of all coefficients."""
        return (0, 0) if self._image is None else (self._image.significant, self._image.coefficients)

    def feed(self, data: bytes) -> None:
        """Take further bytes.

        Raises
        ------
        FormatError
            If the stream is damaged. The message names the byte at which the damaged chunk begins; up to
            there the stream can be used. The decoder can not be used afterwards.
        """
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise InputError(f"data is a {type(data).__name__}; allowed: bytes")
        if self._failure is not None:
            raise FormatError(self._failure)
        try:
            for chunk, part in self._reader.feed(data):
                self._take(chunk, part)
                if chunk.verified:
                    self._verified = chunk.end
        except FormatError as error:
            self._failure = str(error)
            raise

    def limit_coefficients(self, share: float | None) -> None:
        """Decode the exemplar only until a share of its coefficients is significant.

        Its further bytes are held back, while all other data is decoded as it arrives; so a picture of few
        coefficients still has its placements.

        Parameters
        ----------
        share
            0 to 1; None (the initial value) decodes all received bytes.
        """
        self._share = share
        self._feed_exemplar(b"")

    def quilt(self) -> Quilt:
        """Return the known part of the quilt; charts without data have one bare placement.

        Raises
        ------
        InputError
            If bytes are still `needed`.
        """
        header = self._ready().header
        plan = self._shown_plan or PlanDecoder(PlanHead.bare(self.charts), (header.height, header.width))
        shown = self._base or self._fields
        return plan.quilt(() if shown is None else shown.fields).on(self.surface)

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the maps announced so far; the first is "albedo", the exemplar's role."""
        return tuple(self._maps)

    def exemplar(self, role: str = FIRST_ROLE) -> PixelArray:
        """Return a map of the exemplar, decoded from the received bytes: (H, W, C), of its own dtype.

        Raises
        ------
        InputError
            If bytes are still `needed`, or there is no such map.
        """
        self._ready()
        if role not in self._maps:
            raise InputError(f"stream has no map {role!r}; {nearest(role, self._maps)}")
        return self._maps[role].image()

    def texels(self, role: str = FIRST_ROLE, *, threads: int | None = None) -> Texels:
        """Return the texels of a map, painted from the received bytes.

        Raises
        ------
        InputError
            If bytes are still `needed`, or there is no such map.
        """
        with running(threads):
            return paint_map(self.quilt(), role, self.exemplar(role))

    def _ready(self) -> ImageDecoder:
        if self._image is None:
            raise InputError(f"stream needs {self.needed} more bytes")
        return self._image

    def _take(self, chunk: Chunk, part: bytes) -> None:
        tag = chunk.tag
        if tag not in CHUNK_KINDS:
            if tag.isupper():
                raise FormatError(f"byte {chunk.offset}: unknown chunk {tag!r}")
            return
        if chunk.received == len(part):  # its first bytes
            self._check_order(chunk)
        try:
            if tag == "D":
                self._feed_exemplar(part)
            elif tag == "E":
                self._feed_map(chunk, part)
            elif tag == "N" and self._fields is not None:
                self._fields.feed(part)
            elif tag == "P" and self._plan is not None:
                self._plan.feed_placements(part)
                if self._base is not None and self._plan.is_spread:
                    self._show_surface()
            elif tag == "M" and self._plan is not None:
                self._plan.feed_labels(part)
            else:
                self._whole += part
                if chunk.verified:
                    whole, self._whole = bytes(self._whole), bytearray()
                    self._take_whole(tag, whole, chunk.payload_offset)
        except (InputError, FormatError) as error:
            raise FormatError(f"byte {chunk.offset}: chunk {tag!r}: {error}") from None

    def _show_surface(self) -> None:
        self.surface, self.charts, self._base = self._exact, self._layout, None

    def _feed_exemplar(self, part: bytes) -> None:
        image, self._held = self._image, self._held + part
        if image is None:
            return
        place = 0
        while place < len(self._held):
            size = len(self._held) - place
            if self._share is not None:
                missing = self._share * image.coefficients - image.significant
                if missing <= 0:
                    break
                size = max(1, int(missing) // _CAUTION)
            image.feed(bytes(self._held[place : place + size]))
            place += size
        del self._held[:place]

    def _check_order(self, chunk: Chunk) -> None:
        tag, kind = chunk.tag, CHUNK_KINDS[chunk.tag]
        if not kind.repeats and tag in self._seen:
            raise FormatError(f"byte {chunk.offset}: chunk {tag!r} comes twice")
        if tag == "B" and ("S" in self._seen or self._seen.count("B") == MOST_BASES):
            raise FormatError(f"byte {chunk.offset}: chunk 'B' comes after 'S', or after {MOST_BASES} others")
        for group in kind.needs:
            if not set(group) & set(self._seen):
                raise FormatError(f"byte {chunk.offset}: chunk {tag!r} comes before {group[0]!r}")
        if kind.longest is not None and chunk.length > kind.longest:
            raise FormatError(
                f"byte {chunk.offset}: chunk {tag!r} has {chunk.length} bytes; allowed: {kind.longest}"
            )
        for early, late in ("FQ", "tP"):
            if tag == early and late in self._seen:
                raise FormatError(f"byte {chunk.offset}: chunk {early!r} comes after {late!r}")
        self._seen += tag

    def _take_whole(self, tag: str, data: bytes, offset: int) -> None:
        fields = ByteReader(data, offset)
        if tag == "B":
            self._base = parse_base(fields, self._limits)
            self.surface, self.charts = self._base.surface, self._base.charts
            check_chart_budget(self.charts, self._limits)
        elif tag == "S":
            self._exact = parse_surface(fields, self._limits)
        elif tag == "L" and self._exact is not None:
            self._layout = parse_layout(fields, self._exact)
            check_chart_budget(self._layout, self._limits)
            if self._base is None:
                self._show_surface()
        elif tag == "X":
            header = ImageHeader.parse(data, offset=offset)
            if header.length != len(data):
                raise FormatError(
                    f"byte {offset}: {len(data) - header.length} bytes too many in image header"
                )
            if header.channels > 4:
                raise FormatError(f"byte {offset}: exemplar has {header.channels} channels; allowed: 1 to 4")
            if max(header.height, header.width) > MOST_SIDE:
                raise FormatError(
                    f"byte {offset}: exemplar is {header.width}×{header.height}; "
                    f"allowed: 1 to {MOST_SIDE} each way"
                )
            if self._reader.view != offset + len(data) + 4:
                raise FormatError(
                    f"byte {offset}: first view ends here; the file says at {self._reader.view}"
                )
            check_sample_budget([header], self._limits)
            self._image = self._maps[FIRST_ROLE] = ImageDecoder(header)
        elif tag == "F":
            self._fields = FieldDecoder(fields, self._layout)
        elif tag == "R":
            self._add_map(data, offset)
        elif tag == "Q" and self._image is not None:
            shape = self._image.header.height, self._image.header.width
            head = PlanHead.parse(fields, self._layout)
            check_chart_budget(painted_charts(self._layout, head.density), self._limits)
            check_cell_budget(head, self._limits)
            self._plan = PlanDecoder(head, shape)
        elif tag == "t" and self._plan is not None:
            self._plan.add_tones()
        else:
            raise FormatError(f"byte {offset}: chunk {tag!r} has no reader here")

    def _add_map(self, data: bytes, offset: int) -> None:
        role, start = parse_role(data, offset, list(self._maps))
        header = ImageHeader.parse(data[start:], offset=offset + start)
        if header.length != len(data) - start:
            raise FormatError(
                f"byte {offset}: {len(data) - start - header.length} bytes too many in a map's header"
            )
        if (header.height, header.width) != self.exemplar_shape[:2] or header.channels > 4:
            raise FormatError(
                f"byte {offset}: map {role!r} is {header.width}×{header.height}×{header.channels}; "
                "allowed: as the exemplar, 1 to 4 channels"
            )
        if role == "normal" and header.channels != 3:
            raise FormatError(f"byte {offset}: map 'normal' has {header.channels} channels; allowed: 3")
        samples = sum(image.coefficients for image in self._maps.values())
        samples += header.height * header.width * header.channels
        if samples > MAX_MAP_SAMPLES:
            raise FormatError(f"byte {offset}: maps have {samples} samples; allowed: {MAX_MAP_SAMPLES}")
        check_sample_budget([*(image.header for image in self._maps.values()), header], self._limits)
        self._maps[role] = ImageDecoder(header)

    def _feed_map(self, chunk: Chunk, part: bytes) -> None:
        if chunk.received == len(part):
            if not part:
                raise FormatError(f"byte {chunk.payload_offset}: a part of a map is empty")
            if not 1 <= part[0] < len(self._maps):
                raise FormatError(
                    f"byte {chunk.payload_offset}: number of a map is {part[0]}; "
                    f"allowed: 1 to {len(self._maps) - 1}"
                )
            self._fed, part = list(self._maps.values())[part[0]], part[1:]
        if self._fed is not None:
            self._fed.feed(part)

    def check_whole(self) -> None:
        """Check that no bytes are missing or left over.

        Raises
        ------
        FormatError
            If the stream is cut or has unused bytes.
        """
        if self.total is None or not self.complete:
            missing = self.needed if self.total is None else self.total - self.received
            raise FormatError(f"byte {self.received}: file is cut; needs {missing} more bytes")
        if self._image is None or self._plan is None:
            raise FormatError(f"byte {self.received}: file ends without exemplar or placements")
        for role, image in self._maps.items():
            if image.unread:
                raise FormatError(f"byte {self.received}: {image.unread} bytes of map {role!r} are unused")
        if not self._plan.complete or (self._fields is not None and not self._fields.complete):
            raise FormatError(f"byte {self.received}: file ends before its placements do")
        unread = self._plan.unread + (0 if self._fields is None else self._fields.unread)
        if unread:
            raise FormatError(f"byte {self.received}: {unread} bytes of placements are unused")


def read_stream(data: bytes, *, strict: bool = True, limits: Limits | None = None) -> StreamDecoder:
    """Read a whole stream, or a prefix of one.

    Parameters
    ----------
    data
        The bytes.
    strict
        Whether to refuse a cut file and unused bytes.
    limits
        As for `StreamDecoder`.

    Returns
    -------
    StreamDecoder
        A decoder that has read all bytes.

    Raises
    ------
    FormatError
        If the stream is damaged or, if not strict, too short to show anything: the message names the byte.
    """
    decoder = StreamDecoder(limits=limits)
    decoder.feed(data)
    if strict:
        decoder.check_whole()
    elif decoder.needed:
        raise FormatError(f"byte {len(data)}: file is cut; needs {decoder.needed} more bytes")
    return decoder
