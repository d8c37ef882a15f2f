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

"""What ``records.part`` is in compiled code: an address, and no copy."""

from typing import Any

from numba import types as numba_types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from pam_sim.records import part


def _type_part(context: Any) -> Any:
    def typed(whole: Any, place: Any, dtype: Any) -> Any:
        if (isinstance(whole, (numba_types.Array, numba_types.Record))
                and isinstance(place, numba_types.Integer)
                and isinstance(dtype, numba_types.DType)):
            return dtype.dtype
        return None
    return typed


def _part_of_array(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
    return _address(context, builder, signature, data, arguments[1])


def _part_of_record(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _address(context, builder, signature, arguments[0], arguments[1])


type_callable(part)(_type_part)
lower_builtin(part, numba_types.Array, numba_types.Integer, numba_types.DType)(_part_of_array)
lower_builtin(part, numba_types.Record, numba_types.Integer, numba_types.DType)(_part_of_record)


def _address(context: Any, builder: Any, signature: Any, begin: Any, place: Any) -> Any:
    pointer = context.get_value_type(numba_types.CPointer(numba_types.float64))
    numbers = builder.bitcast(begin, pointer)
    found = cgutils.gep_inbounds(builder, numbers, place)
    return builder.bitcast(found, context.get_value_type(signature.return_type))
