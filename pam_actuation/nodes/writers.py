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

"""
Which writer a message came from: the GID that the middleware gives each publisher.

The middleware tells it with every message, rclpy 7.1 leaves it out. ``take`` therefore asks
``librcl`` itself, by its C interface of ROS 2 Iron and later. Where that does not answer as
expected, messages come by rclpy, without a writer.
"""

import ctypes
from functools import partial
from typing import Any

import rclpy

GID_BYTES = 16
_SPARE_BYTES = 256          # behind the message info, should a later one be longer
_LIBRARIES = ('librmw_implementation.so', 'lib{}.so')       # any middleware, or the one at hand


class _Array(ctypes.Structure):
    """``rcutils_uint8_array_t``; its allocator is five pointers."""

    _fields_ = [('buffer', ctypes.c_void_p), ('length', ctypes.c_size_t),
                ('capacity', ctypes.c_size_t), ('allocator', ctypes.c_void_p * 5)]


class _Allocator(ctypes.Structure):
    """``rcutils_allocator_t``."""

    _fields_ = [('pointers', ctypes.c_void_p * 5)]


class _Gid(ctypes.Structure):
    """``rmw_gid_t``."""

    _fields_ = [('identifier', ctypes.c_void_p), ('data', ctypes.c_ubyte * GID_BYTES)]


class _Info(ctypes.Structure):
    """``rmw_message_info_t``."""

    _fields_ = [('source_timestamp', ctypes.c_int64), ('received_timestamp', ctypes.c_int64),
                ('publication_sequence_number', ctypes.c_uint64),
                ('reception_sequence_number', ctypes.c_uint64), ('gid', _Gid),
                ('from_intra_process', ctypes.c_bool), ('spare', ctypes.c_ubyte * _SPARE_BYTES)]


class _Subscription(ctypes.Structure):
    """``rcl_subscription_t``."""

    _fields_ = [('implementation', ctypes.c_void_p)]


def _rcl() -> tuple[Any, Any] | None:
    """Return ``librcl``, declared, and the allocator; None where it is not found."""
    try:
        rcl: Any = ctypes.CDLL('librcl.so')
        rcutils = ctypes.CDLL('librcutils.so')
        take = rcl.rcl_take_serialized_message
        rcutils.rcutils_get_default_allocator.restype = _Allocator
        for name in ('subscription', 'publisher'):
            handle = getattr(rcl, f'rcl_{name}_get_rmw_handle')
            handle.restype, handle.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
        rcl.rcutils_reset_error = rcutils.rcutils_reset_error
    except (OSError, AttributeError):
        return None
    take.restype = ctypes.c_int
    take.argtypes = [ctypes.c_void_p] * 4
    return rcl, rcutils.rcutils_get_default_allocator()


class WriterTake:
    """
    Take serialized messages with the GIDs of their writers.

    Parameters
    ----------
    handle
        Of an rclpy subscription.
    message_type : type
        Of its messages.

    """

    def __init__(self, handle: Any, message_type: Any) -> None:
        self._by_rclpy = partial(handle.take_message, message_type, True)
        self._info = _Info()
        self._array = _Array()
        found = _rcl()
        self._rcl: Any = None
        if found is not None:
            self._rcl, allocator = found
            self._array.allocator = allocator.pointers
            with handle:
                self._subscription = ctypes.c_void_p(handle.pointer)
                end = self._rcl.rcl_subscription_get_rmw_handle(self._subscription)
            # The name of the middleware is the first thing in its handles and in each GID.
            self._identifier = end and ctypes.c_void_p.from_address(end).value
        self._arguments = ctypes.byref(self._array), ctypes.byref(self._info), None

    def __call__(self) -> Any:
        """
        Return (bytes, info) of the next message, None if there is none.

        ``info`` is that of rclpy with ``writer``: the GID as bytes, None where it is not known.
        The handle is in use by the caller (``with handle``).
        """
        if self._rcl is None or not self._identifier:
            item = self._by_rclpy()
            return item and (item[0], {**item[1], 'writer': None})
        if self._rcl.rcl_take_serialized_message(self._subscription, *self._arguments):
            self._rcl.rcutils_reset_error()     # nothing there is one of the reasons
            return None
        info = self._info
        known = info.gid.identifier == self._identifier
        return ctypes.string_at(self._array.buffer, self._array.length), {
            'source_timestamp': info.source_timestamp,
            'received_timestamp': info.received_timestamp,
            'publication_sequence_number': info.publication_sequence_number,
            'reception_sequence_number': None, 'writer': bytes(info.gid.data) if known else None}


def gid_of(publisher: Any) -> bytes | None:
    """Return the GID of an rclpy publisher as bytes, None where it cannot be told."""
    found = _rcl()
    if found is None:
        return None
    for library in _LIBRARIES:
        try:
            ask = ctypes.CDLL(library.format(
                rclpy.get_rmw_implementation_identifier())).rmw_get_gid_for_publisher
        except (OSError, AttributeError):
            continue
        ask.argtypes, gid = [ctypes.c_void_p] * 2, _Gid()
        with publisher.handle:
            end = found[0].rcl_publisher_get_rmw_handle(
                ctypes.c_void_p(publisher.handle.pointer))
            if end and not ask(end, ctypes.byref(gid)):
                return bytes(gid.data)
    return None
