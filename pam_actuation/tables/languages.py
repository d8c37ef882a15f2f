# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What columns are called in other languages than English."""

import functools
import unicodedata

# English word, and what it is in Dutch, German, French, Spanish, Italian, Portuguese, Swedish,
# Danish, Finnish, Polish, Czech, Slovak, Hungarian, Romanian, Turkish, Russian, Japanese, Chinese
# and Korean, where that is another word. `tension` stays English: a force, and no voltage.
_WORDS = {
    'time': 'tijd zeit temps tiempo tempo tid aika czas czasu čas času idő timp zaman время '
            'времени 時間 時刻 时间 시간 uhrzeit zeitpunkt kloktijd tijdstip heure hora ora '
            'godzina klockslag klokkeslæt kellonaika időpont saat 时刻 시각 temporal temporale '
            'časové',
    'date': 'datum fecha päivämäärä päiväys pvm dátum tarih дата 日付 日期 날짜 일자',
    'date time': '日時 일시',
    'stamp': 'marca marcatura znacznik razítko damgası метка',
    'time stamp': 'zeitmarke horodatage horodate tidsstämpel tidsstempel aikaleima időbélyeg '
                  'タイムスタンプ 时间戳 타임스탬프',
    'elapsed': 'messdauer versuchsdauer écoulé écoulée transcurrido trascorso decorrido '
               'verstreken verstrichen verstrichene',
    'elapsed time': 'laufzeit prüfzeit versuchszeit testzeit looptijd meettijd',
    'pressure': 'druk druck pression presión pressione pressão tryck tryk paine ciśnienie tlak '
                'nyomás presiune basınç давление 圧力 壓力 压力 압력',
    'force': 'kracht kraft fuerza forza força voima siła síla sila erő forță kuvvet сила 力 張力 '
             '张力 拉力 힘 장력',
    'position': 'positie posición posizione posição asema pozycja poloha pozíció poziție konum '
                'положение 位置 위치',
    'displacement': 'verplaatsing weg hubweg verschiebung auslenkung déplacement desplazamiento '
                    'spostamento deslocamento przemieszczenie elmozdulás deplasare перемещение '
                    '変位 位移 변위',
    'stroke': 'hub slag corsa carrera',
    'contraction': 'contractie kontraktion verkürzung verkorting raccourcissement contracción '
                   'acortamiento contrazione accorciamento contração skurcz kontrakce kontrakcia '
                   'сокращение 収縮 收缩 收缩量 収縮量 수축',
    'length': 'lengte länge longueur longitud lunghezza comprimento längd længde pituus długość '
              'délka dĺžka hossz lungime uzunluk длина 長さ 长度 길이',
    'angle': 'hoek winkel ángulo angolo vinkel kulma kąt úhel uhol szög unghi açı угол 角度 각도',
    'voltage': 'spanning spannung voltaje voltaggio tensione tensão spänning napięcie napětí '
               'napätie feszültség tensiune gerilim напряжение 電圧 电压 전압',
    'reference': 'referentie referenz führungsgröße referencia riferimento referência 目標値 '
                 '目标值',
    'setpoint': 'consigne consigna',
    'soll': 'sollwert vorgabe vorgabewert',
    'command': 'kommando stellgröße stellwert stellsignal ansteuerung befehl commande comando '
               'mando',
    'regulator': 'regler regelaar régulateur regulador regolatore',
    'valve': 'ventil ventiel vanne électrovanne válvula electroválvula valvola elettrovalvola',
    'supply': 'versorgung voeding alimentation alimentación alimentazione',
    'disturbance': 'störung störgröße verstoring perturbation perturbación disturbo perturbazione',
    'joint': 'gelenk gewricht articulation articulación articolazione',
    'knee': 'knie genou rodilla ginocchio',
    'muscle': 'muskel spier músculo muscular muscolo muscolare musculaire',
    'measured': 'gemessen gemessene gemessener messwert gemeten mesure mesuré mesurée medido '
                'medida misurato misurata',
    'actual': 'istwert tatsächlich réel réelle effettivo effettiva',
    'sensor': 'aufnehmer messaufnehmer fühler opnemer capteur sensore transductor trasduttore',
    'pull': 'zug trek traction tracción trazione',
    'inner': 'innen intern interne interno interna intérieur intérieure',
    'wire': 'draht draad',
    'current': 'strom stroom courant corriente corrente',
    'load': 'belastung belasting carga carico',
    'loadcell': 'wägezelle kraftmessdose krachtcel',
    'cell': 'zelle dose cel cella celda cellule',
    'signal': 'señal segnale signaal',
    'value': 'wert waarde valeur valor valore',
    'supply pressure': 'vordruck',
    'gauge pressure': 'überdruck relativdruck overdruk surpression',
    'absolute': 'absolut absoluut absolue absolu absoluto absoluta assoluto assoluta',
    'flexor': 'beuger fléchisseur flessore',
    'extensor': 'strecker extenseur estensore',
}
# What stands in front in a compound word only, as `soll` in `Solldruck`.
_FRONTS = {
    'soll': 'soll', 'actual': 'ist', 'measured': 'mess meet', 'command': 'stell',
    'control': 'regel steuer stuur', 'supply': 'speise netz speicher tank zuluft',
    'external': 'stör',
    'cable': 'seil', 'axial': 'axial', 'load': 'last', 'chamber': 'kammer', 'sensor': 'sensor',
    'proportional': 'proportional', 'inner': 'innen', 'line': 'leitung', 'inlet': 'eingang',
}
_ENDS = {'signal': 'signal', 'sensor': 'sensor geber', 'stamp': 'stempel'}
# Words above of which compounds are made, at either end: languages that write them as one word.
_IN_COMPOUNDS = (
    'druck druk tryck tryk kraft kracht weg hub länge lengte längd spannung spanning spänning '
    'kontraktion verkürzung verkorting winkel hoek vinkel zeit tijd wert waarde sollwert istwert '
    'messwert muskel spier zug trek regler regelaar ventil ventiel versorgung voeding gelenk knie '
    'absolut absoluut strom stroom draht beuger strecker aufnehmer opnemer fühler zelle dose cel'
).split()
# Ends that tell what is measured although the front is not known, and that end no English word.
_TAILS = 'druck kraft kracht spannung länge kontraktion verkürzung'.split()
_LEAST_FRONT = 3                    # letters of it; fewer mean something alone, as `f`
_JOINTS = ('', 's', 'n', 'en')      # between two parts, as in `Versorgungsdruck`
_SPELLED_OUT = str.maketrans({'ä': 'ae', 'ö': 'oe', 'ü': 'ue', 'å': 'aa', 'ø': 'oe'})


def plain(text: str) -> str:
    """Return a text in lower case, without accents."""
    parts = unicodedata.normalize('NFD', unicodedata.normalize('NFKC', text).casefold())
    return unicodedata.normalize('NFC', ''.join(
        one for one in parts if not unicodedata.combining(one)))


def in_english(word: str) -> str:
    """
    Return what a word of a column's name is in English; itself where it is not known.

    A compound becomes several words: ``muscle pressure`` for ``Muskeldruck``. Of one whose
    front is not known the front stays as it is: ``feder force`` for ``Federkraft``.
    """
    flat = plain(word)
    known = _english().get(flat)
    if known is None and flat.isalpha():
        known = _of_compound(flat)
    return known or word


@functools.cache
def _english() -> dict[str, str]:
    return _spellings(_WORDS)


@functools.cache
def _parts() -> tuple[dict[str, str], dict[str, str]]:
    """Return the parts that a compound may begin and those that it may end with, in English."""
    words = {spelled: _english()[spelled] for spelled in _spellings(
        {'': ' '.join(_IN_COMPOUNDS)})}
    return {**words, **_spellings(_FRONTS)}, {**words, **_spellings(_ENDS)}


def _spellings(words: dict[str, str]) -> dict[str, str]:
    """Return foreign to English word, also with ``ae`` for ``ä``."""
    return {spelled: english for english, foreign in words.items() for word in foreign.split()
            for spelled in (plain(word), plain(word.translate(_SPELLED_OUT)))}


@functools.cache
def _of_compound(flat: str) -> str:
    """Return the English words of a compound, '' for a word that is none."""
    fronts, ends = _parts()
    for size in range(len(flat) - 2, 2, -1):          # the longest end first
        tail = flat[-size:]
        if tail in ends and (front := _front(flat[:-size], fronts)):
            return f'{front} {ends[tail]}'
    tail = next((one for one in _spellings({'': ' '.join(_TAILS)}) if flat.endswith(one)), '')
    front = flat.removesuffix(tail)
    return f'{front} {ends[tail]}' if tail and len(front) >= _LEAST_FRONT else ''


def _front(text: str, fronts: dict[str, str]) -> str:
    """Return the English words of the parts that a text consists of, '' where some is unknown."""
    for joint in _JOINTS:
        own = text.removesuffix(joint) if joint else text
        if joint and own == text:
            continue
        if own in fronts:
            return fronts[own]
        for size in range(3, len(own) - 2):
            if own[:size] in fronts and (rest := _front(own[size:], fronts)):
                return f'{fronts[own[:size]]} {rest}'
    return ''
