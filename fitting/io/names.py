"""Names of columns in English, German, French, Spanish and Japanese, and parsing of headings."""

import re
from typing import NamedTuple

from fitting.data import units

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
    "creep modulus": "creepmodulus tensilecreepmodulus flexuralcreepmodulus ec(t) kriechmodul"
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
    cuts = [(pattern, *found) for pattern in PARTS for found in _cuts(pattern, cell)]
    for pattern, name, unit in cuts:
        kind = kind_of(name)
        if kind and (pattern is not BLANK or (kind in KINDS and units.is_unit(KINDS[kind], unit or ""))):
            return Heading(plain(name), kind, unit)
    for pattern, name, unit in cuts:
        if unit is not None and (
            pattern in BRACKETS or any(units.is_unit(kind, unit) for kind in units.KINDS)
        ):
            return Heading(plain(name), None, unit)
    return Heading(plain(cell), None, None)


def _cuts(pattern: str, cell: str) -> list[tuple[str, str | None]]:
    """Return the ways (name, unit) in which a pattern splits the cell; by an underscore, at each of them."""
    if pattern == "_":
        places = [k for k, letter in enumerate(cell) if letter == "_" and not re.search(r"\s[\[(]", cell[k:])]
        return [(cell[:k], cell[k + 1 :]) for k in reversed(places)]
    found = re.fullmatch(pattern, cell)
    return [(found["name"], found.groupdict().get("unit"))] if found else []


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
