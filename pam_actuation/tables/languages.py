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
    'time': 'tijd zeit temps tiempo tempo tid aika czas čas idő timp zaman время 時間 時刻 时间 '
            '시간',
    'pressure': 'druk druck pression presión pressione pressão tryck tryk paine ciśnienie tlak '
                'nyomás presiune basınç давление 圧力 壓力 压力 압력',
    'force': 'kracht kraft fuerza forza força voima siła síla sila erő forță kuvvet сила 力 張力 '
             '张力 拉力 힘 장력',
    'position': 'positie posición posizione posição asema pozycja poloha pozíció poziție konum '
                'положение 位置 위치',
    'displacement': 'verplaatsing weg verschiebung déplacement desplazamiento spostamento '
                    'deslocamento przemieszczenie elmozdulás deplasare перемещение 変位 位移 변위',
    'contraction': 'contractie kontraktion verkürzung raccourcissement contracción contrazione '
                   'contração skurcz kontrakce kontrakcia сокращение 収縮 收缩 收缩量 収縮量 수축',
    'angle': 'hoek winkel ángulo angolo vinkel kulma kąt úhel uhol szög unghi açı угол 角度 각도',
    'voltage': 'spanning spannung voltaje voltaggio tensione tensão spänning napięcie napětí '
               'napätie feszültség tensiune gerilim напряжение 電圧 电压 전압',
    'reference': 'referentie referenz consigne referencia riferimento referência 目標値 目标值',
}


def plain(text: str) -> str:
    """Return a text in lower case, without accents."""
    parts = unicodedata.normalize('NFD', unicodedata.normalize('NFKC', text).lower())
    return unicodedata.normalize('NFC', ''.join(
        one for one in parts if not unicodedata.combining(one)))


@functools.cache
def _english() -> dict[str, str]:
    return {plain(word): english for english, words in _WORDS.items() for word in words.split()}


def in_english(word: str) -> str:
    """Return what a word of a column's name is in English; itself where it is not known."""
    return _english().get(plain(word), word)
