"""A bag that unpacks to more than any recording would is refused before anything reads it."""

import numpy as np
import pytest

pytest.importorskip("rosbags")
from bags import _writer, make, nanoseconds, picture_messages, typestore
from rosbags import rosbag1, rosbag2

from proxytune.errors import InputError
from proxytune.importing import Wanted, bag_chunks, read_source
from proxytune.settings import LARGEST

PACKINGS = {
    "ros1 bz2": ("ros1", lambda writer: writer.set_compression(rosbag1.Writer.CompressionFormat.BZ2)),
    "ros1 lz4": ("ros1", lambda writer: writer.set_compression(rosbag1.Writer.CompressionFormat.LZ4)),
    "sqlite3 file": ("sqlite3", lambda writer: packed(writer, "FILE")),
    "sqlite3 message": ("sqlite3", lambda writer: packed(writer, "MESSAGE")),
    "mcap file": ("mcap", lambda writer: packed(writer, "FILE")),
    "mcap message": ("mcap", lambda writer: packed(writer, "MESSAGE")),
    "mcap storage": ("mcap", lambda writer: packed(writer, "STORAGE")),
}


def packed(writer, mode):
    writer.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)


def write_dense(path, packing):
    """A bag of black pictures."""
    storage, pack = PACKINGS[packing]
    store, writer = typestore(storage), _writer(path, storage)
    pack(writer)
    with writer:
        connection = None
        for topic, kind, received, fields in picture_messages(np.arange(8.0), np.zeros((8, 500, 500, 3), np.uint8)):
            connection = connection or writer.add_connection(topic, kind, typestore=store)
            message = make(store, kind, fields)
            raw = store.serialize_ros1(message, kind) if storage == "ros1" else store.serialize_cdr(message, kind)
            writer.write(connection, nanoseconds(received), raw)
    return path


@pytest.mark.parametrize("packing", PACKINGS)
def test_a_bag_that_unpacks_to_too_much_is_refused_with_what_raises_the_limit(packing, tmp_path, monkeypatch):
    bag = write_dense(tmp_path / ("dense.bag" if packing.startswith("ros1") else "dense"), packing)
    with pytest.raises(InputError, match="no topic has"):
        read_source(bag, Wanted())
    monkeypatch.setattr(bag_chunks, "BAG_MB", 3)
    monkeypatch.setattr(bag_chunks, "DENSEST", 1)
    with pytest.raises(InputError, match=rf"unpacks to [345] MB or more, of 3 MB at most.*{LARGEST}="):
        read_source(bag, Wanted())
    monkeypatch.setenv(LARGEST, "10")
    with pytest.raises(InputError, match="no topic has"):
        read_source(bag, Wanted())
