// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;

namespace StereoCell.Editor
{
    /// <summary>
    /// Decompresses a Zstandard frame (RFC 8878) of known size. The volumes of a bundle are such frames, and Unity has no
    /// decoder for them. Dictionaries are not supported. A checksum in the frame is ignored, because the importer has
    /// already checked the SHA-256 of the file. A frame that breaks the RFC ends in InvalidDataException.
    /// </summary>
    public static partial class Zstd
    {
        const uint Magic = 0xFD2FB528;
        const int MostOfBlock = 128 << 10;

        /// <param name="data">Bytes that contain the frame.</param>
        /// <param name="offset">First byte of the frame.</param>
        /// <param name="length">Length of the frame, bytes.</param>
        /// <param name="size">Length of the decompressed data, bytes.</param>
        public static byte[] Unpack(byte[] data, int offset, int length, int size)
        {
            if (offset < 0 || length < 0 || offset > data.Length - length) throw Broken("it lies beyond the file");
            try
            {
                return new Frame(data, offset, offset + length, size).Unpack();
            }
            catch (IndexOutOfRangeException)  // a damaged frame reads or writes beyond an array
            {
                throw Broken("it ends too early");
            }
        }

        static InvalidDataException Broken(string why)
        {
            return new InvalidDataException("the zstd frame is damaged: " + why);
        }

        static int HighBit(uint value)
        {
            var bit = -1;
            for (; value != 0; value >>= 1) bit++;
            return bit;
        }

        static readonly short[] LiteralCounts =
        {
            4, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 2, 1, 1, 1, 1, 1,
            -1, -1, -1, -1,
        };

        static readonly short[] MatchCounts =
        {
            1, 4, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
            1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1,
        };

        static readonly short[] OffsetCounts =
        {
            1, 1, 1, 1, 1, 1, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1,
        };

        static readonly byte[] LiteralBits =
        {
            0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 3, 4, 6, 7, 8, 9, 10, 11, 12,
            13, 14, 15, 16,
        };

        static readonly byte[] MatchBits =
        {
            0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
            1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16,
        };

        /// <summary>The smallest length of each code. A code with b extra bits covers 2^b lengths, and the next code starts
        /// after them.</summary>
        static int[] Bases(byte[] bits, int first)
        {
            var bases = new int[bits.Length];
            for (var i = 0; i < bits.Length; i++)
            {
                bases[i] = i == 0 ? first : bases[i - 1] + (1 << bits[i - 1]);
            }
            return bases;
        }

        static readonly int[] LiteralBases = Bases(LiteralBits, 0);
        static readonly int[] MatchBases = Bases(MatchBits, 3);

        sealed class Frame
        {
            readonly byte[] data;
            readonly int end;
            readonly byte[] output;
            int at;
            int done;  // bytes of the output that are written
            Huffman huffman;
            Fse literals;
            Fse offsets;
            Fse matches;
            readonly int[] last = { 1, 4, 8 };  // the three most recent offsets, with the initial values of the RFC

            public Frame(byte[] data, int start, int end, int size)
            {
                this.data = data;
                this.end = end;
                at = start;
                output = new byte[size];
            }

            long Number(int bytes)
            {
                if (bytes > end - at) throw Broken("it ends too early");
                long value = 0;
                for (var i = 0; i < bytes; i++) value |= (long)data[at + i] << 8 * i;
                at += bytes;
                return value;
            }

            public byte[] Unpack()
            {
                if ((uint)Number(4) != Magic) throw Broken("it has another format");
                var descriptor = (int)Number(1);
                var isSingle = (descriptor & 32) != 0;
                if ((descriptor & 11) != 0) throw Broken("it needs a dictionary");
                if (!isSingle) Number(1);  // the window's size is not needed: the whole output stays in memory
                var width = descriptor >> 6;
                var bytes = width == 0 ? (isSingle ? 1 : 0) : 1 << width;
                var stated = Number(bytes) + (bytes == 2 ? 256 : 0);
                if (bytes > 0 && stated != output.Length) throw Broken("its size differs from the stated one");
                bool isLast;
                do
                {
                    var head = (int)Number(3);
                    isLast = (head & 1) != 0;
                    Block(head >> 1 & 3, head >> 3);
                }
                while (!isLast);
                if (done != output.Length) throw Broken("its size differs from the stated one");
                return output;
            }

            void Block(int type, int size)
            {
                if (size > MostOfBlock) throw Broken("a block is too large");
                if (type == 0)
                {
                    if (size > end - at || size > output.Length - done) throw Broken("it ends too early");
                    Buffer.BlockCopy(data, at, output, done, size);
                    at += size;
                    done += size;
                }
                else if (type == 1)
                {
                    var value = (byte)Number(1);
                    for (var i = 0; i < size; i++) output[done++] = value;
                }
                else if (type == 2)
                {
                    if (size > end - at) throw Broken("it ends too early");
                    var stop = at + size;
                    Sequences(Literals(stop), stop);
                    at = stop;
                }
                else throw Broken("a block has the reserved type");
            }

            byte[] Literals(int stop)
            {
                int head = data[at], type = head & 3, format = head >> 2 & 3;
                if (type < 2)
                {
                    var headBytes = format == 1 ? 2 : format == 3 ? 3 : 1;
                    var plain = (int)Number(headBytes) >> (headBytes == 1 ? 3 : 4);
                    if (plain > MostOfBlock) throw Broken("a block has too many literals");
                    var found = new byte[plain];
                    if (type == 1)
                    {
                        var value = (byte)Number(1);
                        for (var i = 0; i < plain; i++) found[i] = value;
                        return found;
                    }
                    if (plain > stop - at) throw Broken("its literals are incomplete");
                    Buffer.BlockCopy(data, at, found, 0, plain);
                    at += plain;
                    return found;
                }
                var bits = format < 2 ? 10 : format == 2 ? 14 : 18;
                var sizes = Number(format < 2 ? 3 : format + 2) >> 4;
                var count = (int)(sizes & (1 << bits) - 1);
                var packed = (int)(sizes >> bits);
                var from = at;
                if (count > MostOfBlock || packed > stop - at) throw Broken("its literals are incomplete");
                at += packed;
                if (type == 2) huffman = Huffman.Read(data, ref from, at);
                if (huffman == null) throw Broken("it repeats a table that does not exist");
                var to = new byte[count];
                if (format == 0)
                {
                    huffman.Unpack(data, from, at, to, 0, count);
                    return to;
                }
                if (at - from < 6) throw Broken("its literals are incomplete");
                var each = (count + 3) / 4;
                var begin = from + 6;
                for (var i = 0; i < 4; i++)
                {
                    var long_ = i < 3 ? data[from + 2 * i] | data[from + 2 * i + 1] << 8 : at - begin;
                    if (long_ > at - begin || each * i > count) throw Broken("its literals are incomplete");
                    huffman.Unpack(data, begin, begin + long_, to, each * i, i < 3 ? Math.Min(each * (i + 1), count) : count);
                    begin += long_;
                }
                return to;
            }

            Fse Table(int mode, Fse before, short[] counts, int log, int symbols, int mostLog, int stop)
            {
                if (mode == 0) return new Fse(counts, log);
                if (mode == 1)
                {
                    var symbol = (byte)Number(1);
                    if (symbol >= symbols) throw Broken("it has an unknown code");
                    return new Fse(symbol);
                }
                if (mode == 2) return Fse.Read(data, ref at, stop, symbols, mostLog);
                if (before == null) throw Broken("it repeats a table that does not exist");
                return before;
            }

            void Sequences(byte[] from, int stop)
            {
                var count = (int)Number(1);
                if (count >= 128) count = count == 255 ? (int)Number(2) + 0x7F00 : (count - 128 << 8) + (int)Number(1);
                var used = 0;
                if (count > 0)
                {
                    var modes = (int)Number(1);
                    literals = Table(modes >> 6, literals, LiteralCounts, 6, 36, 9, stop);
                    offsets = Table(modes >> 4 & 3, offsets, OffsetCounts, 5, 32, 8, stop);
                    matches = Table(modes >> 2 & 3, matches, MatchCounts, 6, 53, 9, stop);
                    var stream = new Backwards(data, at, stop);
                    int a = stream.Read(literals.Log), b = stream.Read(offsets.Log), c = stream.Read(matches.Log);
                    for (var i = 0; i < count; i++)
                    {
                        var code = offsets.Symbol[b];
                        if (code > 30) throw Broken("an offset is too large");
                        var far = (1 << code) + stream.Read(code);
                        var matchCode = matches.Symbol[c];
                        var match = MatchBases[matchCode] + stream.Read(MatchBits[matchCode]);
                        var literalCode = literals.Symbol[a];
                        var plain = LiteralBases[literalCode] + stream.Read(LiteralBits[literalCode]);
                        Copy(from, used, plain, OffsetOf(far, plain), match);
                        used += plain;
                        if (i == count - 1) break;
                        a = literals.Base[a] + stream.Read(literals.Bits[a]);
                        c = matches.Base[c] + stream.Read(matches.Bits[c]);
                        b = offsets.Base[b] + stream.Read(offsets.Bits[b]);
                    }
                    if (stream.Left != 0) throw Broken("its sequences have another length than stated");
                }
                Copy(from, used, from.Length - used, 1, 0);
            }

            /// <summary>The offset for a stored value. Values 1 to 3 repeat a recent offset. If no literals came before the
            /// match, they are shifted by one, and 3 means the last offset minus 1 (RFC 8878, 3.1.1.5).</summary>
            int OffsetOf(int value, int plain)
            {
                if (value > 3)
                {
                    last[2] = last[1];
                    last[1] = last[0];
                    return last[0] = value - 3;
                }
                var which = value - (plain == 0 ? 0 : 1);
                var offset = which == 3 ? last[0] - 1 : last[which];
                if (which > 1) last[2] = last[1];
                if (which > 0) last[1] = last[0];
                return last[0] = offset;
            }

            void Copy(byte[] from, int at, int plain, int offset, int match)
            {
                if (plain < 0 || plain > from.Length - at || plain + (long)match > output.Length - done) throw Broken("its size differs from the stated one");
                Buffer.BlockCopy(from, at, output, done, plain);
                done += plain;
                if (match == 0) return;
                if (offset < 1 || offset > done) throw Broken("an offset leads to before the start");
                for (var i = 0; i < match; i++, done++) output[done] = output[done - offset];
            }
        }
    }
}
