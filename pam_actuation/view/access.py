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

"""Who may see the page: this machine without further ado, others with a token."""

import hmac
import ipaddress
import secrets
import socket
from urllib.parse import urlsplit

from pam_sim.errors import InputError

LOOPBACK = '127.0.0.1'
TOKEN_BYTES = 18


class Access:
    """
    The address that the server listens on, and what is asked of whoever comes.

    Without a token only names of this machine are answered. A page of another site, whose name
    was made to point here, is therefore refused.

    Parameters
    ----------
    host : str, optional
        Address or name to listen on; default: this machine only, without a token. Elsewhere
        everybody gives a random one.

    Raises
    ------
    InputError
        The host is no address of this machine.

    """

    def __init__(self, host: str | None = None) -> None:
        self.host = LOOPBACK if host is None else host
        self.is_local = is_loopback(self.host)
        self.token = '' if self.is_local else secrets.token_urlsafe(TOKEN_BYTES)

    def url(self, port: int) -> str:
        """Return what to open in a browser, the token included."""
        name = self.host
        if self.host == LOOPBACK:
            name = 'localhost'
        elif self.is_local and self.host != 'localhost':    # of names that one alone is answered
            name = str(socket.getaddrinfo(self.host, None)[0][4][0])
        elif self.host in ('0.0.0.0', '::'):
            name = socket.gethostname()
        if ':' in name:
            name = f'[{name}]'
        return f'http://{name}:{port}/' + (f'?token={self.token}' if self.token else '')

    def allows_host(self, header: str) -> bool:
        """Tell whether a request that names this host in its header is meant for this server."""
        if self.token:
            return True
        name = urlsplit(f'//{header}').hostname
        # A name is not looked up: whoever owns it could let it point here.
        return name == 'localhost' or _is_loopback_address(name or '')

    def is_right(self, given: str | None) -> bool:
        """Tell whether a token is the right one, or none is needed."""
        return not self.token or hmac.compare_digest((given or '').encode(), self.token.encode())


def is_loopback(host: str) -> bool:
    """
    Tell whether an address is reached from this machine only.

    Raises
    ------
    InputError
        It is neither an address nor a name that can be looked up.

    """
    try:
        found = socket.getaddrinfo(host, None)
    except (OSError, UnicodeError):
        raise InputError(f'{host!r} is neither an address nor a known name; allowed are the '
                         'addresses of this machine, such as 0.0.0.0 for all', '--host') from None
    return all(_is_loopback_address(str(one[4][0]).partition('%')[0]) for one in found)


def _is_loopback_address(text: str) -> bool:
    """Tell whether a text is an address, not a name, of this machine only."""
    try:
        return ipaddress.ip_address(text).is_loopback
    except ValueError:
        return False
