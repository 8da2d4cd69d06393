"""An SSH server on loopback that gives the files of a folder by SFTP, to whoever has the one key that it takes."""

import os
import socket
import threading
from contextlib import contextmanager, suppress
from types import SimpleNamespace

import paramiko
from patience import patient


class _Door(paramiko.ServerInterface):
    def __init__(self, key):
        self._key = key

    def get_allowed_auths(self, username):
        return "publickey"

    def check_auth_publickey(self, username, key):
        return paramiko.AUTH_SUCCESSFUL if key == self._key else paramiko.AUTH_FAILED

    def check_channel_request(self, kind, number):
        return paramiko.OPEN_SUCCEEDED


class _Files(paramiko.SFTPServerInterface):
    def __init__(self, server, root, asked):
        super().__init__(server)
        self._root, self._asked = root, asked

    def _attributes(self, path, name):
        try:
            return paramiko.SFTPAttributes.from_stat(path.stat(), name)
        except OSError as reason:
            return paramiko.SFTPServer.convert_errno(reason.errno)

    def stat(self, path):
        return self._attributes(self._root / path.lstrip("/"), path)

    lstat = stat

    def list_folder(self, path):
        folder = self._root / path.lstrip("/")
        self._asked.append(("list", path))
        return [self._attributes(file, file.name) for file in folder.iterdir()] if folder.is_dir() else 2

    def open(self, path, flags, attributes):
        file = self._root / path.lstrip("/")
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) or not file.is_file():
            return paramiko.SFTP_NO_SUCH_FILE
        self._asked.append(("open", path))
        handle = paramiko.SFTPHandle(flags)
        handle.filename, handle.readfile = path, file.open("rb")
        handle.stat = lambda: self.stat(path)
        return handle


@contextmanager
def served_by_ssh(folder, host_key, user_key):
    """Serve a folder while the block lasts: its `port`, and what was `asked` for."""
    listener = socket.create_server(("127.0.0.1", 0))
    store = SimpleNamespace(port=listener.getsockname()[1], asked=[])
    open_ones = []

    def accept():
        with suppress(OSError):
            while True:
                transport = paramiko.Transport(listener.accept()[0])
                open_ones.append(transport)
                transport.add_server_key(host_key)
                transport.set_subsystem_handler("sftp", paramiko.SFTPServer, _Files, folder, store.asked)
                with suppress(paramiko.SSHException, EOFError):
                    transport.start_server(server=_Door(user_key))

    thread = threading.Thread(target=accept)
    thread.start()
    try:
        yield store
    finally:
        # A socket that is only closed would leave the thread waiting.
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(timeout=patient(30))
        for transport in open_ones:
            transport.close()
            transport.join(timeout=patient(30))
