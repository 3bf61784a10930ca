"""Blocks of numbers in a text; an export may hold several, each with its own header."""

import csv
import datetime
import importlib
import itertools
import math
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.data import units
from jaxcontact._support import plugins

# Workbooks (.xlsx, .xls, .ods) as text, by the library python-calamine, which is imported on first use.


def as_text(name: str) -> str:
    """Return the rows of all sheets with tabs between cells; the name of each of several sheets stands above it.

    Raises:
        ValueError: python-calamine is not installed, or cannot read the file; the message says what to do.
    """
    try:
        library = importlib.import_module("python_calamine")
    except ImportError:
        raise ValueError(
            f"{name}: a workbook needs python-calamine: pip install 'jaxcontact[workbooks]', or save the sheet as CSV"
        ) from None
    try:
        book = library.CalamineWorkbook.from_path(name)
        sheets = {sheet: book.get_sheet_by_name(sheet).to_python() for sheet in book.sheet_names}
    except Exception as error:  # its errors have no common base
        what = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise ValueError(f"{name}: not a workbook that can be read ({what}): save the sheet as CSV") from None
    filled = {sheet: rows for sheet, rows in sheets.items() if rows}
    parts = ["\n".join("\t".join(map(_cell, row)) for row in rows) for rows in filled.values()]
    if len(parts) > 1:
        parts = [f"[step]\n{sheet}\n{part}" for sheet, part in zip(filled, parts, strict=True)]
    return "\n".join(parts) + "\n"


def _cell(value: Any) -> str:
    """Return a cell as text: numbers in full, times of day and durations as seconds in hh:mm:ss, without line breaks."""
    if isinstance(value, datetime.timedelta):
        minutes, seconds = divmod(value.total_seconds(), 60.0)
        return f"{int(minutes // 60)}:{int(minutes % 60):02d}:{seconds:09.6f}"
    if isinstance(value, datetime.time):
        return f"{value.hour}:{value.minute:02d}:{value.second + 1e-6 * value.microsecond:09.6f}"
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())


# Names of columns in English, German, French, Spanish and Japanese, and parsing of headings.


# Names are compared without case (one letter apart: T is a temperature), blanks, dots, hyphens, underscores.
NAMES = {
    "time": "t time testtime seriestime elapsedtime totaltime creeptime timeonsample runtime time(sequence)"
    " temps tempsd'essai tempsdemesure tempsécoulé durée tiempo tiempodeensayo"
    " tiempototal 時間 経過時間 測定時間 試験時間 zeit messzeit prüfzeit versuchszeit gesamtzeit kriechzeit testzeit",
    "step time": "tempsd'étape tiempodepaso ステップ時間 steptime intervaltime segmenttime"
    " time(action) schrittzeit intervallzeit abschnittszeit"
    " segmentzeit",
    "compliance": "J j j(t) jt compliance creepcompliance shearcompliance shearcreepcompliance"
    " complaisance complaisancedefluage complianza complianzadefluencia"
    " コンプライアンス クリープコンプライアンス nachgiebigkeit"
    " kriechnachgiebigkeit schernachgiebigkeit schubnachgiebigkeit komplianz",
    "tensile compliance": "D d(t) tensilecompliance tensilecreepcompliance uniaxialcompliance"
    " extensionalcompliance axialcompliance flexuralcompliance dehnnachgiebigkeit zugnachgiebigkeit"
    " zugkriechnachgiebigkeit biegenachgiebigkeit",
    "strain": "strain strain(t) creepstrain γ γ(t) gamma gamma(t) shearstrain scherung schiebung gleitung"
    " scherdehnung deformation scherdeformation déformation déformationdecisaillement"
    " cisaillement deformación deformacióndecorte deformacióncortante"
    " deformacion ひずみ 歪み せん断ひずみ",
    "tensile strain": "ε ε(t) epsilon tensilestrain axialstrain extensionalstrain engineeringstrain"
    " truestrain elongation flexuralstrain dehnung kriechdehnung zugdehnung längsdehnung",
    "stress": "stress stress(t) appliedstress creepstress τ tau shearstress sxy spannung schubspannung scherspannung"
    " contrainte contraintedecisaillement esfuerzo esfuerzocortante esfuerzodecorte"
    " tensión tensióncortante 応力 せん断応力",
    "tensile stress": "σ sigma tensilestress axialstress extensionalstress engineeringstress truestress"
    " flexuralstress zugspannung normalspannung",
    "relaxation modulus": "g(t) e(t) erelax grelax relaxationmodulus shearrelaxationmodulus tensilerelaxationmodulus"
    " relaxationsmodul modulederelaxation móduloderelajación 緩和弾性率",
    "modulus": "G modulus shearmodulus modul schubmodul schermodul gleitmodul module módulo 弾性率",
    "tensile modulus": "E elasticmodulus youngsmodulus young'smodulus youngmodulus elastizitätsmodul emodul"
    " tensilemodulus indentationmodulus",
    # ISO 899-1 and 899-2: stress over strain under a constant stress, 1/D(t), which is no relaxation modulus
    "creep modulus": "creepmodulus tensilecreepmodulus flexuralcreepmodulus ec(t) kriechmodul creepmoduluse(t)"
    " creepmodulusec creepmodulusec(t) kriechmodulec kriechmodulec(t) creepstiffness creepstiffnesss(t)"
    " zugkriechmodul biegekriechmodul moduledefluage módulodefluencia クリープ弾性率",
    "shear creep modulus": "shearcreepmodulus schubkriechmodul scherkriechmodul",
    "reduced modulus": "reducedmodulus reducedmod er reduziertermodul",
    "stated modulus": "storagemod",
    "contact area": "contactarea projectedarea projectedcontactarea kontaktfläche airedecontact áreadecontacto 接触面積",
    "angular frequency": "ω omega w angularfrequency angfrequency kreisfrequenz winkelfrequenz pulsation"
    " fréquenceangulaire frecuenciaangular 角周波数 角振動数",
    "frequency": "ν f freq frequency testfrequency frequenz prüffrequenz fréquence frecuencia 周波数",
    "storage modulus": "g' gstor storagemodulus shearstoragemodulus speichermodul speicherschubmodul"
    " moduledeconservation moduleélastique módulodealmacenamiento móduloelástico 貯蔵弾性率 貯蔵せん断弾性率",
    "loss modulus": "g'' g\" gloss lossmodulus shearlossmodulus verlustmodul verlustschubmodul"
    " moduledeperte modulevisqueux módulodepérdida móduloviscoso 損失弾性率 損失せん断弾性率",
    "complex modulus": "g* |g*| complexmodulus complexshearmodulus dynamicmodulus dynamicshearmodulus absolutemodulus"
    " dynamischermodul dynamischerschubmodul komplexermodul komplexerschubmodul"
    " modulecomplexe módulocomplejo 複素弾性率",
    "tensile complex modulus": "e* |e*| tensilecomplexmodulus tensiledynamicmodulus dynamicmodulus|e*| dynamicmodulus(|e*|)",
    "loss factor": "tanδ tan(δ) tan(d) tandelta tan(delta) losstangent lossfactor dampingfactor verlustfaktor"
    " dämpfungsfaktor facteurdeperte factordepérdida 損失正接",
    "phase angle": "δ(g*) phaseangle phaseangle(δ) phaselag lossangle phasenwinkel verlustwinkel"
    " angledephase déphasage ángulodefase 位相角",
    "tensile storage modulus": "e' estor tensilestoragemodulus",
    "tensile loss modulus": "e'' e\" eloss tensilelossmodulus",
    "load": "P p F fn load force normalforce loadonsample indentload indentationload indentationforce"
    " fz verticaldeflection vdeflection kraft standardforce standardkraft normalkraft prüfkraft last eindringkraft"
    " forcenormale fuerza fuerzanormal carga 荷重 力 押込み荷重",
    "depth": "h d pd disp position(z) depth indentation indentationdepth penetration penetrationdepth displacement"
    " standardweg standardtravel"
    " displacementintosurface indentdisp indentdisplacement eindringtiefe eindringung tiefe verschiebung profondeur"
    " enfoncement déplacement pénétration profundidad desplazamiento penetración 深さ 押込み深さ 変位",
    "contact stiffness": "contactstiffness harmoniccontactstiffness storagestiffness storagestiff kontaktsteifigkeit"
    " rigiditédecontact rigidezdecontacto 接触剛性",
    "stiffness": "stiffness harmonicstiffness dynamicstiffness steifigkeit rigidité rigidez 剛性",
    "delta": "δ delta",  # a depth or a phase angle
    "height": "height(measured) measuredheight heightmeasured zsensor",
    "smoothed height": "height(measured&smoothed) smoothedmeasuredheight",
    "commanded height": "z height height(piezo) piezo piezoposition zposition höhe piezoweg",
    "separation": "tipsampleseparation verticaltipposition tipposition",  # falls as the tip moves inwards
    "thickness": "thickness filmthickness layerthickness tribofilmthickness meanthickness dicke"
    " schichtdicke filmdicke épaisseur épaisseurdufilm espesor grosor 膜厚 厚さ",
    "viscosity": "viscosity shearviscosity viskosität scherviskosität viscosité viscosidad 粘度",
    "shear rate": "shearrate scherrate schergeschwindigkeit vitessedecisaillement velocidaddecorte せん断速度",
    "temperature": "T temp temperature sampletemperature temperatur probentemperatur température temperatura 温度",
    "segment": "segment segmentindex segindex segmentno segmentnumber segmenttype phase segmentname abschnitt"
    " interval intervalno intervalnumber intervall step stepno stepnumber stepindex schritt cycle cycleno cyclenumber"
    " zyklus sweepno sweepnumber run runno runnumber lauf",
}
KINDS = {
    "time": "t", "step time": "t", "compliance": "J", "tensile compliance": "J", "strain": "strain",
    "tensile strain": "strain", "relaxation modulus": "stress", "stress": "stress", "tensile stress": "stress",
    "angular frequency": "omega", "frequency": "omega", "storage modulus": "stress", "loss modulus": "stress",
    "tensile storage modulus": "stress", "tensile loss modulus": "stress", "complex modulus": "stress",
    "tensile complex modulus": "stress", "loss factor": "ratio", "phase angle": "angle",
    "load": "load", "depth": "depth", "delta": "depth", "height": "depth",
    "thickness": "depth", "smoothed height": "depth", "commanded height": "depth", "separation": "depth",
    "modulus": "stress", "tensile modulus": "stress", "creep modulus": "stress", "shear creep modulus": "stress",
    "reduced modulus": "stress", "stated modulus": "stress", "contact area": "area",
    "temperature": "temperature", "stiffness": "stiffness", "contact stiffness": "stiffness",
}  # fmt: skip
LOOKUP = {name: kind for kind, names in NAMES.items() for name in names.split()}
BLANK = r"(?P<name>.*\S)\s+(?P<unit>\S+)"
BRACKETS = (
    r"(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]*)\]",
    r"(?P<name>.*\S)\s*\((?P<unit>(?:[^()]|\([^()]*\))*)\)",
    r"(?P<name>.*\S)\s*[{<（【](?P<unit>[^{}<>（）【】]*)[}>）】]",
)
AGAIN = re.compile(r"(?<=[\])])\.[0-9]+$")  # suffix that pandas adds to the second of two equal names
LOGARITHM = re.compile(r"\s*(?:log|lg|ln|sqrt)(?:10|2|e)?(?=[\s_(\[])", re.IGNORECASE)
FACTOR = re.compile(r"10\s*(?:\^\s*[-−+]?|[-−+])[0-9]|10[⁻⁺]?[⁰¹²³⁴-⁹]|[0-9][eE][-−+]?[0-9]")
PARTS = (
    r"(?P<name>.+)",
    *BRACKETS,
    r"(?P<name>.*\S)\s+in\s+(?P<unit>\S.*)",
    r"(?P<name>[^/]*\S)\s*/\s*(?P<unit>\S.*)",
    r"(?P<name>.*\S)\s*,\s*(?P<unit>\S+)",
    "_",
    BLANK,
)
PRIMES = str.maketrans({"′": "'", "’": "'", "´": "'", "″": '"', "”": '"'})
DECLARED = ("shear", "scher", "schub", "schieb", "gleit", "γ", "gamma", "τ", "tau", "j", "sxy")


class Heading(NamedTuple):
    """A parsed heading: name: normalised; kind: of NAMES, None if unknown; unit: as written, None if not given."""

    name: str
    kind: str | None
    unit: str | None


def read_heading(cell: str) -> Heading:
    """Parse a header cell such as "J [1/GPa]", "Depth (nm)", "time / s", "F/mN", "time_s" or "Kraft in N"."""
    cell = AGAIN.sub("", cell.strip().strip(":"))
    # the ways (pattern, name, unit) to split the cell
    cuts: list[tuple[str, str, str | None]] = []
    for pattern in PARTS:
        if pattern == "_":  # at each underscore, from the right
            places = [
                k for k, letter in enumerate(cell) if letter == "_" and not re.search(r"\s[\[(]", cell[k:])
            ]
            cuts += [(pattern, cell[:k], cell[k + 1 :]) for k in reversed(places)]
        elif found := re.fullmatch(pattern, cell):
            cuts.append((pattern, found["name"], found.groupdict().get("unit")))
    for pattern, name, unit in cuts:
        kind = kind_of(name)
        if kind and (pattern is not BLANK or (kind in KINDS and units.is_unit(KINDS[kind], unit or ""))):
            return Heading(plain(name), kind, unit)
    for pattern, name, unit in cuts:
        if unit is not None and (pattern in BRACKETS or _is_any_unit(unit)):
            return Heading(plain(name), None, unit)
    return Heading(plain(cell), None, None)


def kind_of(name: str) -> str | None:
    """Return the kind of a name, with or without a symbol after it: "Zeit t", "Compliance J(t)"."""
    head, _, symbol = name.strip().rpartition(" ")
    kind = LOOKUP.get(plain(head))
    return LOOKUP.get(plain(name)) or (kind if kind and LOOKUP.get(plain(symbol)) == kind else None)


def plain(name: str) -> str:
    """Return the name without blanks and marks, in lower case if it is longer than one letter."""
    name = re.sub(r"[\s_.\-]", "", name).translate(PRIMES)
    return name if len(name) == 1 else name.lower()


def says_shear(name: str) -> bool:
    """Return whether a normalised name states that shear is meant."""
    return name.lower().startswith(DECLARED)


# Text of a file as numbered lines, for various encodings.


PACKED = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x1f\x8b")  # xlsx and ods, xls, gz
WORKBOOK, SHEETS = PACKED[:2], (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")
# first characters of HTML, XML, JSON, RTF and PDF; a line in angle brackets without a closing tag ("<Mach-1 File>") is text
MARKUP = re.compile(r"<[?!]|<(?=[\s\S]*?(?:</|/>))|[{]|\[\s*[\[{]|%PDF")
INVISIBLE = str.maketrans("", "", "\ufeff\u200b")  # byte-order marks within joined files, zero-width spaces
OPEN = re.compile(r'(?:^|[,;\t])\s*"[^"]*$')  # a quoted cell that continues on the next line
LONGEST = 4  # largest number of lines of such a cell
JAPANESE = tuple(name for name in LOOKUP if len(name) > 1 and min(name) > "\u3000")
REMARK = re.compile(r"\s*(#+|//+|%+(?=\s*\w))\s?")


class Line(NamedTuple):
    """A line of a file: number, from 1; text, without a comment mark; remark: whether it had one."""

    number: int
    text: str
    remark: bool


def read_lines(path: str | os.PathLike) -> list[Line]:
    """Return the lines that are not blank; a line that begins with #, // or % is a remark.

    Raises:
        ValueError: no such file, not text, or nothing in it.
    """
    name = os.fspath(path)
    content = decode(name).translate(INVISIBLE)
    if MARKUP.match(content.lstrip()):
        raise ValueError(
            f"{name}: expected rows of numbers, got {content.strip()[:12]!r}: save the table as CSV"
        )
    found, texts, k = [], content.splitlines(), 0
    while k < len(texts):
        size = 1
        if OPEN.search(texts[k]):  # up to the line in which the cell ends ("Time" over "(s)" in a workbook)
            for more in range(2, LONGEST + 1):
                joined = " ".join(texts[k : k + more])
                if joined.count('"') % 2 == 0 and not OPEN.search(joined):
                    size = more
                    break
        text = " ".join(texts[k : k + size])
        if text.strip(" \t\r\n,;"):
            mark = REMARK.match(text)
            found.append(Line(k + 1, text[mark.end() :] if mark else text, bool(mark)))
        k += size
    if not any(line.text.strip() and not line.remark for line in found):
        raise ValueError(f"{name}: expected a table, got an empty file")
    return found


def decode(name: str) -> str:
    """Return the text of a file in UTF-8 or UTF-16, with or without byte-order mark, else in Shift JIS where it has names
    of columns in Japanese, else in Latin-1."""
    try:
        raw = Path(name).read_bytes()
    except OSError as error:
        raise ValueError(f"{name}: cannot be read: {error.strerror}") from None
    suffix = Path(name).suffix.removeprefix(".").lower()
    if suffix in plugins.names(plugins.READERS):
        return _by_plugin(name, suffix)
    if raw.startswith(WORKBOOK) and name.lower().endswith(SHEETS):
        return as_text(name)
    if raw.startswith(PACKED):
        raise ValueError(f"{name}: expected text, got binary data (a workbook or an archive): save a CSV")
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    if raw and raw[1::2].count(0) > 0.8 * len(raw[1::2]):
        return raw.decode("utf-16-le", errors="replace")
    if b"\0" in raw:
        raise ValueError(f"{name}: expected text, got binary data: export it as text or CSV")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        pass
    try:
        text = raw.decode("cp932")
    except UnicodeDecodeError:
        text = ""
    return text if any(name in text for name in JAPANESE) else raw.decode("latin-1")


def _by_plugin(name: str, suffix: str) -> str:
    """Return the table that a plug-in (``jaxcontact.readers``) reads from files with this suffix, as text.

    The plug-in is a function of the path that returns the columns by their headings, {"t [s]": numbers, "J [1/Pa]": ...}, or
    such columns for each step by its name; headings are read as those of any text file.

    Raises:
        ValueError: the plug-in cannot be imported, fails, or returns something else; the message names it.
    """
    read = plugins.load(plugins.READERS, suffix)
    try:
        found = read(name)
        steps = found if all(isinstance(one, Mapping) for one in found.values()) else {"": found}
        if not steps:
            raise ValueError("no columns")
        parts = []
        for step, columns in steps.items():
            rows = zip(*(np.asarray(column, float).tolist() for column in columns.values()), strict=True)
            lines = ["\t".join(columns), *("\t".join(map(repr, row)) for row in rows)]
            parts.append("\n".join([f"[step]\n{step}"] * bool(step) + lines))
    except Exception as error:  # whatever somebody else's function raises
        reason = (str(error) or type(error).__name__).splitlines()[0][:160]
        raise ValueError(
            f"{name}: expected columns by their headings from the plug-in for .{suffix} files, got: {reason}"
        ) from error
    return "\n".join(parts) + "\n"


# Cells of a line and the numbers in them, in several dialects of delimited text.


MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---", "*"}
SAMPLE = 400  # number of lines that determine the dialect
_DIGITS = {".": r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)", ",": r"(?:[0-9]+,?[0-9]*|,[0-9]+)"}
PLAIN = {mark: re.compile(rf"[+-]?{digits}(?:[eEdD][+-]?[0-9]+)?") for mark, digits in _DIGITS.items()}
GROUPED = {
    ".": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[,'’][0-9]{3})+(?:\.[0-9]*)?"),
    ",": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.'’][0-9]{3})+(?:,[0-9]*)?"),
}
CLOCK = re.compile(r"([0-9]{1,4}):([0-5][0-9]):([0-5][0-9](?:[.,][0-9]+)?)")  # hours, minutes, seconds
INFINITE = re.compile(r"([+-]?)inf(?:inity)?", re.IGNORECASE)
EXPONENT = str.maketrans("dD", "ee")
POINT = str.maketrans("dD,", "ee.")
SPACES = re.compile(r"(?<=[0-9])[\u00a0\u202f\u2009](?=[0-9]{3})")  # spaces between groups of three digits


class Dialect(NamedTuple):
    """Dialect of delimited text: separator of cells, None for any white space; decimal mark, "." or ","."""

    separator: str | None
    decimal: str


def split(text: str, separator: str | None) -> list[str]:
    """Return the cells of a line, stripped; a separator within quotes is text."""
    text = text.strip("\r\n ")
    if separator is None:
        return text.split()
    if '"' not in text:
        return [cell.strip() for cell in text.split(separator)]
    cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip('"') for cell in cells]


def number(cell: str, decimal: str) -> float | None:
    """Return the number in a cell, or None; digits may be grouped by three: "1.512,8" is 1512.8 if "," is the mark.

    A time as hh:mm:ss is a number of seconds.
    """
    clock = CLOCK.fullmatch(cell)
    if clock:
        hours, minutes, seconds = clock.groups()
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))
    if not PLAIN[decimal].fullmatch(cell):
        cell = SPACES.sub("", cell.replace("−", "-"))
        if GROUPED[decimal].fullmatch(cell):
            cell = re.sub(rf"['’{'.' if decimal == ',' else ','}]", "", cell)
        elif INFINITE.fullmatch(cell):
            return float(cell)
        elif not PLAIN[decimal].fullmatch(cell):
            return None
    return float(cell.translate(POINT if decimal == "," else EXPONENT))


def is_missing(cell: str) -> bool:
    """Return whether a cell holds no value."""
    return cell.lower() in MISSING


def is_data(row: list[str], decimal: str) -> bool:
    """Return whether a row has two numbers and fewer words, or one number beside missing cells.

    A clock time counts as a number in the first cell alone, since a date has one among its words.
    """
    numbers = sum(
        number(cell, decimal) is not None and (k == 0 or not CLOCK.fullmatch(cell))
        for k, cell in enumerate(row)
    )
    missing = sum(map(is_missing, row))
    words = len(row) - numbers - missing
    if numbers < 2 or any(cell.endswith(":") for cell in row):
        return numbers == 1 and len(row) == 1 + missing > 1
    return words < numbers or (words == numbers and number(row[0], decimal) is not None)


def choose(path: str, lines: list[Line], decimal: str | None) -> Dialect:
    """Return the dialect in which most lines are rows of numbers, and most cells numbers.

    Raises:
        ValueError: no rows of numbers, or an ambiguous decimal mark.
    """
    plain = [line.text for line in lines if not line.remark]
    sample = plain[:: math.ceil(len(plain) / SAMPLE)]
    marks = (decimal,) if decimal else (".", ",")
    # for each dialect: rows of numbers, the share of their cells that are numbers or missing, minus grouped numbers
    ranked: dict[Dialect, tuple[int, float, int]] = {}
    for dialect in itertools.starmap(Dialect, itertools.product(("\t", ";", ",", None), marks)):
        rows = [split(text, dialect.separator) for text in sample]
        rows = [row for row in rows if is_data(row, dialect.decimal)]
        cells = [cell for row in rows for cell in row]
        fine = sum(is_missing(cell) or number(cell, dialect.decimal) is not None for cell in cells)
        grouped = sum(bool(GROUPED[dialect.decimal].fullmatch(cell)) for cell in cells)
        ranked[dialect] = len(rows), round(fine / max(len(cells), 1), 6), -grouped
    best = max(ranked, key=lambda dialect: ranked[dialect])
    if ranked[best][0] == 0:
        what = (
            "expected rows of at least two numbers (no dates) between commas, semicolons, tabs or blanks,"
            " got none: save the table as CSV"
        )
        raise ValueError(f"{path}: line {lines[-1].number}: {what}")
    twin = Dialect(best.separator, "," if best.decimal == "." else ".")
    both = ranked.get(twin, ())[:2] == ranked[best][:2]
    if both and (ranked[best][2] or ranked[twin][2]):
        # Numbers that the other mark reads as groups of three digits. They are not ambiguous where every number of a
        # column has the mark, as all would be whole thousands.
        rows = [row for row in (split(text, best.separator) for text in sample) if is_data(row, best.decimal)]
        marked = [{best.decimal in cell for cell in column} for column in zip(*rows, strict=False)]
        if ranked[best][2] or best.separator == best.decimal or {True, False} in marked:
            raise ValueError(
                f"{path}: expected one decimal mark, got numbers that read both ways: give decimal='.' or ','"
            )
    return best


# Detection of the header of a block of numbers, and of a line of units, among the preceding lines.


class Header(NamedTuple):
    """A header: cells: names, with units where they have them; units: of a line of units; line: number of the line of
    names."""

    cells: list[str]
    units: list[str]
    line: int


def find_header(lines: list[Line], width: int, separator: str | None) -> Header | None:
    """Return the line with the most known names over matching columns; without any, the last line of ``width`` words."""
    best: tuple[tuple, list[str]] | None = None
    for k, line in enumerate(lines):
        cells = _cells(line.text, width, separator)
        rank = (known(cells) > 0, len(cells) >= width, known(cells), k)
        if cells and (best is None or rank > best[0]):
            best = rank, cells
    if best is None:
        return None
    (*_, k), cells = best
    # The units: in a line below in which a known column has a unit of its kind, otherwise the words directly above the
    # numbers if there is one for each name (wrong ones are rejected when the column is read), or the line above.
    below = lines[k + 1 :]
    ways = (_under(way, len(cells)) for line in below for way in ways_to_split(line.text, separator))
    found = next((way for way in ways if way and any(map(_fits, cells, way))), [])
    if not found:
        last = _under(split(below[-1].text, separator), len(cells)) if below and not below[-1].remark else []
        words = [text for text in last if re.search(r"\w", text)]
        every = words and len(words) == len([text for text in last if text])
        found = last if every else [""] * len(cells)
    if not any(found) and k > 0:
        above = _under(split(lines[k - 1].text, separator), len(cells))
        found = above if above and all(map(_fits, cells, above)) else found
    # Powers of ten in a line below ("x 1e-6 1/Pa") belong to the units, which are rejected when the column is read; a
    # fact ("sensitivity: 4.8E-8") has none.
    for line in below:
        factors = _under(split(line.text, separator), len(found))
        if any(map(FACTOR.search, factors)) and not factors[0].endswith(":"):
            pairs = zip(factors, found, strict=True)
            found = [f"{text} {unit}".strip() if FACTOR.search(text) else unit for text, unit in pairs]
            break
    return Header(cells, found, lines[k].number)


def _cells(text: str, width: int, separator: str | None) -> list[str]:
    """Return the line's cells as a header, [] if it is not one: matching names, else several names, else words."""
    every = [_trimmed(cells, width) for cells in ways_to_split(text, separator)]
    if separator is not None and not _may_be_header(every[0]):
        every[0] = before_gap(every[0])  # a stray number beside the table
    ways = [cells for cells in every if _may_be_header(cells)]
    for cells in ways:
        own = separator is not None and cells is every[0]
        if known(cells) and (len(cells) == width or (own and known(cells) >= 2)):
            return cells
    several = max(ways, key=known, default=[])
    if known(several) >= 2:
        return several
    return every[0] if every[0] in ways and len(every[0]) == width else []


def _may_be_header(cells: list[str]) -> bool:
    """Return whether there are at least two cells, no number, and not only units."""
    words = [cell.strip("[]() ") for cell in cells if cell]
    numbers = any(number(cell, mark) is not None for cell in cells for mark in ".,")
    return len(cells) >= 2 and not numbers and not all(map(_is_any_unit, words))


def before_gap(cells: list[str]) -> list[str]:
    """Return the cells up to the first empty one after a filled one: what stands beyond it is beside the table."""
    first = next((k for k, cell in enumerate(cells) if cell), 0)
    return cells[: next((k for k in range(first, len(cells)) if not cells[k]), len(cells))]


def _is_any_unit(text: str) -> bool:
    return any(units.is_unit(kind, text) for kind in units.KINDS)


def known(cells: list[str]) -> int:
    """Return the number of known names."""
    return sum(read_heading(cell).kind is not None for cell in cells)


def ways_to_split(text: str, separator: str | None) -> list[list[str]]:
    """Return the possible splits of a header, whose separator may differ from that of the numbers."""
    ways = [split(text, separator)] + [split(text, other) for other in ("\t", ";", ",")]
    ways.append(re.split(r"\t|\s{2,}", text.strip()))
    ways.append([a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', text)])
    ways.append([cell.strip(" ,;") for cell in re.findall(r"[^\[(]+[\[(][^\])]*[\])]+", text)])
    ways.append(re.split(r"\s+(?![\[(])", text.strip()))
    return ways


def _trimmed(cells: list[str], width: int) -> list[str]:
    """Return the cells without empty ones at the end, and without a label ("columns:") that has no column."""
    while len(cells) > 1 and not cells[-1]:
        cells = cells[:-1]
    return cells[1:] if len(cells) == width + 1 and cells[0][-1:] in ("", ":") else cells


def _under(texts: list[str], width: int) -> list[str]:
    """Return the texts without brackets, one for each column; [] if they are too many or only one for several columns."""
    texts = [text.strip("[]() ") for text in _trimmed(texts, width)]
    if len(texts) > width and not texts[width]:
        texts = texts[:width]  # the others are beside the table
    return texts + [""] * (width - len(texts)) if 1 < len(texts) <= width else []


def _fits(cell: str, unit: str) -> bool:
    kind = read_heading(cell).kind
    return bool(unit) and kind in KINDS and units.is_unit(KINDS[kind], unit)


Row = tuple[int, list[str]]
LEAST = 5  # fewest numbers in a line of a table that lies on its side
FEW = 5  # rows, or a tenth of those before, of a table of statistics after the curve
ASIDE = {
    "omega": "Frequency",
    "t": "Time",
    "depth": "Depth",
}  # abscissae of such a table whose numbers carry their units
FOREIGN = 3  # number of lines in another dialect that is not accidental
HEADING_NAMES = (
    r"(?m)^\[step\]\s*\n(?P<name>.+)",  # TRIOS
    r"(?m)^segment:\s*(?P<name>\S.*)",  # JPK
    r"(?m)^<(?P<name>(?!/|END |INFO|DATA|DIVIDER|Mach-1)[^<>\n]+)>",  # Mach-1
    r"(?im)^(?P<name>interval)l?\b[^:\n]*(?:point|punkte)[^:\n]*:\W*(?P<number>\d+)",  # Anton Paar
)


class Block(NamedTuple):
    """A block of numbers.

    name: of the step, interval or segment, "" if it has none; before: the text above; header; width: number of cells of
    a complete row; rows: (line, cells) of numbers, and of text between or after them.
    """

    name: str
    before: str
    header: Header | None
    width: int
    rows: list[Row]

    @property
    def kinds(self) -> list[str | None]:
        """The quantity that the heading of each column names, None where it names none."""
        return [read_heading(cell).kind for cell in self.header.cells] if self.header else []

    def numbers(self, place: int, lines: set[int], decimal: str) -> np.ndarray:
        """Return the numbers (n,) of a column in the rows at some lines, nan where a cell is no number."""
        cells = [row[place] if place < len(row) else "" for line, row in self.rows if line in lines]
        values = [number(cell, decimal) for cell in cells]
        return np.array([np.nan if value is None else value for value in values])


class Table(NamedTuple):
    """The blocks of a file, its dialect, and the places of columns and the units that the caller states."""

    path: str
    dialect: Dialect
    blocks: list[Block]
    columns: dict[str, Any]
    units: dict[str, str]


def read_table(
    path: str | os.PathLike,
    decimal: str | None,
    columns: dict | None,
    units: dict | None,
    keys: Sequence[str],
) -> Table:
    """Split a file into blocks, each of which begins with a line of known column names.

    Args:
        path: of a text file.
        decimal: the decimal mark, "." or ",", if it is ambiguous.
        columns: of the caller; tables side by side are one block where they have positions, which are those of the file.
        units: of the caller.
        keys: of the quantities that the reader knows.

    Raises:
        ValueError: no file, no text, no rows of numbers, an unknown key, or one column for two quantities.
    """
    name = os.fspath(path)
    if decimal not in (None, ".", ","):
        raise ValueError(f"decimal: expected '.' or ',', got {decimal!r}")
    lines = read_lines(path)
    dialect = choose(name, lines, decimal)
    # groups of lines of text, each with the rows of numbers that follow
    groups: list[tuple[list[Line], list[Row]]] = [([], [])]
    for line in lines:
        cells = split(line.text, dialect.separator)
        own = before_gap(cells)  # words may stand beside the table, beyond an empty cell
        is_row = is_data(cells, dialect.decimal) or (len(own) > 1 and _all_numbers(own, dialect.decimal))
        if is_row and not line.remark:
            groups[-1][1].append((line.number, cells))
        elif groups[-1][1]:
            groups.append(([line], []))
        else:
            groups[-1][0].append(line)
    blocks: list[Block] = []
    for k, (before, rows) in enumerate(groups):
        for other in itertools.starmap(Dialect, itertools.product(",;\t", ".,")):
            texts = [split(line.text, other.separator) for line in before if not line.remark]
            hits = [text for text in texts if len(text) > 1 and _all_numbers(text, other.decimal)]
            if other != dialect and len(hits) >= FOREIGN:
                raise ValueError(
                    f"{name}: line {before[0].number}: expected one separator and decimal mark throughout, got others in "
                    f"{len(hits)} lines: write all lines in one dialect"
                )
        header = find_header(before, _width(rows), dialect.separator) if rows else None
        text = "\n".join(line.text for line in before)
        sheet = any(line.text.strip() == "[step]" for line in before)
        if sheet and not rows and blocks:
            continue  # a sheet of words
        begins = not blocks or sheet or bool(header and known(header.cells))
        if header and not begins:
            # statistics of the curve: all that follows is small beside it and has no known names
            size = len(blocks[-1].rows)
            few = sum(len(each) for _, each in groups[k:]) <= min(max(FEW, size // 10), size // 2)
            later = [
                find_header(above, _width(each), dialect.separator) for above, each in groups[k:] if each
            ]
            begins = few and not any(each and known(each.cells) for each in later)
        if begins:
            width = len(header.cells) if header else _width(rows)
            blocks.append(Block(_name(text), text, header, width, list(rows)))
        else:
            more = [(line.number, split(line.text, dialect.separator)) for line in before if not line.remark]
            blocks[-1].rows.extend(more + rows)
    if not any(block.header and known(block.header.cells) > 1 for block in blocks):
        blocks = _on_side(lines, dialect) or blocks
    if not any(isinstance(one, int) for one in (columns or {}).values()):
        blocks = [part for block in blocks for part in _apart(block, dialect)]
    for option, given in (("columns", columns), ("units", units)):
        for key in given or {}:
            if key not in keys:
                raise ValueError(f"{name}: {option}: expected keys among {list(keys)}, got {key!r}")
    chosen = list((columns or {}).values())
    if len(set(chosen)) < len(chosen):
        raise ValueError(f"{name}: columns: expected different columns, got {columns}")
    return Table(name, dialect, blocks, columns or {}, units or {})


def _on_side(lines: list[Line], dialect: Dialect) -> list[Block]:
    """Return the tables of a file whose quantities stand in lines: a known name, then numbers, at least two such lines."""
    found: list[Block] = []
    group: list[tuple[Line, str, list[str]]] = []
    abscissa: tuple[Line, str, list[str]] | None = None
    before: list[str] = []
    for line in [*lines, Line(0, "", False)]:
        cells = split(line.text, dialect.separator)
        while cells and not cells[-1]:
            cells.pop()
        name, values = (cells[0], cells[1:]) if cells else ("", [])
        if values and values[0] and _is_any_unit(values[0].strip("[]() ")):
            name, values = f"{name} [{values[0].strip('[]() ')}]", values[1:]
        numbers = sum(number(cell, dialect.decimal) is not None for cell in values)
        fits = numbers >= LEAST and number(name, dialect.decimal) is None and bool(name)
        if fits and all(is_missing(cell) or number(cell, dialect.decimal) is not None for cell in values):
            group.append((line, name, values))
            continue
        every = ([abscissa] if abscissa else []) + group
        kinds = [kind for _, name, _ in every if (kind := read_heading(name).kind)]
        if len(kinds) > 1 and len(set(kinds)) == len(kinds) and len(every) == len({one[1] for one in every}):
            width, first = len(every), every[0][0].number
            longest = max(len(values) for *_, values in every)
            columns = [values + [""] * (longest - len(values)) for *_, values in every]
            text = "\n".join(before)
            rows = [(first, list(row)) for row in zip(*columns, strict=True)]
            found.append(
                Block(_name(text), text, Header([one[1] for one in every], [""] * width, first), width, rows)
            )
        if group:
            group, before = [], []
        before.append(line.text)
        # The abscissa may stand above: cells that are numbers with one and the same unit ("0.1 Hz", "1 Hz").
        abscissa = None
        parts = [cell.rpartition(" ") for cell in cells[1:] if cell]
        unit = parts[0][2] if parts else ""
        alike = len(parts) >= LEAST and all(last == unit for *_, last in parts)
        if alike and all(number(one, dialect.decimal) is not None for one, *_ in parts):
            kind = next((kind for kind in ASIDE if units.is_unit(kind, unit)), None)
            known_name = cells[0] if read_heading(cells[0]).kind else ASIDE.get(kind or "")
            if known_name and kind:
                abscissa = line, f"{known_name} [{unit}]", [one for one, *_ in parts]
    return found


def _apart(block: Block, dialect: Dialect) -> list[Block]:
    """Return the tables that stand side by side in a block, whose names repeat ("X, Y, X, Y"), each with its own rows.

    The line above the names may have the name of each table over its first column.
    """
    if block.header is None:
        return [block]
    cells = [re.sub(r"\.\d+$", "", cell) for cell in block.header.cells]  # pandas numbers equal names
    labels = [cell and f"{cell}\n{unit}" for cell, unit in zip(cells, block.header.units, strict=True)]
    first = next((label for label in labels if label), "")
    starts = [k for k, label in enumerate(labels) if label == first]
    ends = [*starts[1:], len(labels)]
    groups = [labels[a:b] for a, b in zip(starts, ends, strict=True)]
    for group in groups:
        while group and not group[-1]:
            group.pop()
    size = len(groups[0])
    if (
        len(starts) < 2
        or size < 2
        or any(group != groups[0] for group in groups)
        or len(set(groups[0])) < size
    ):
        return [block]
    above = [split(line, dialect.separator) for line in block.before.splitlines()]
    named = [
        row
        for row in above
        if {k for k, cell in enumerate(row) if cell} == set(starts) and row != block.header.cells
    ]
    found = []
    for start in starts:
        rows = [(line, row[start : start + size]) for line, row in block.rows]
        rows = [(line, row) for line, row in rows if not all(map(is_missing, row))]
        name = named[-1][start] if named else f"columns {start + 1} to {start + size}"
        header = block.header._replace(
            cells=cells[start : start + size], units=block.header.units[start : start + size]
        )
        if rows:
            found.append(Block(f"{block.name} {name}".strip(), block.before, header, size, rows))
    return found


def _all_numbers(row: list[str], decimal: str) -> bool:
    return all(number(cell, decimal) is not None for cell in row)


def _width(rows: list[Row]) -> int:
    """Return the most common number of cells."""
    return Counter(len(cells) for _, cells in rows).most_common(1)[0][0]


def _name(text: str) -> str:
    """Return the name that the lines above a block state."""
    found = [match.groupdict() for pattern in HEADING_NAMES for match in re.finditer(pattern, text)]
    if not found:
        return ""
    return " ".join(filter(None, (found[-1]["name"].strip(), found[-1].get("number"))))
