// SPDX-License-Identifier: Apache-2.0
using System;

namespace StereoCell.Editor
{
    /// <summary>The codes inside a frame's blocks: bit streams that are read backwards, tables of finite-state entropy, and
    /// Huffman tables.</summary>
    public static partial class Zstd
    {
        /// <summary>Reads bits from the end of a stream towards its start, the direction of zstd's bit streams.</summary>
        sealed class Backwards
        {
            readonly byte[] data;
            readonly int start;
            int bit;  // number of bits that are left

            public Backwards(byte[] data, int start, int end)
            {
                this.data = data;
                this.start = start;
                if (end <= start || data[end - 1] == 0) throw Broken("a stream has no end");
                bit = 8 * (end - start - 1) + HighBit(data[end - 1]);  // the highest bit is an end mark, not data
            }

            public int Left { get { return bit; } }

            /// <summary>Read the next bits. Bits before the start of the stream count as 0; the last look-ups need
            /// them.</summary>
            public int Read(int count)
            {
                bit -= count;
                return Look(bit, count);
            }

            public int Peek(int count)
            {
                return Look(bit - count, count);
            }

            public void Skip(int count)
            {
                bit -= count;
            }

            int Look(int from, int count)
            {
                if (count == 0) return 0;
                if (from < 0)
                {
                    var there = count + from;
                    return there <= 0 ? 0 : Look(0, there) << -from;
                }
                var at = start + (from >> 3);
                ulong bits = 0;
                for (var i = 0; i < 5 && at + i < data.Length; i++) bits |= (ulong)data[at + i] << 8 * i;
                return (int)(bits >> (from & 7) & (1ul << count) - 1);
            }
        }

        /// <summary>A table of finite-state entropy. Each state has a symbol, the number of bits to read for the next state,
        /// and a base that is added to these bits.</summary>
        sealed class Fse
        {
            public readonly int Log;
            public readonly byte[] Symbol;
            public readonly byte[] Bits;
            public readonly ushort[] Base;

            public Fse(short[] counts, int log)
            {
                Log = log;
                var size = 1 << log;
                Symbol = new byte[size];
                Bits = new byte[size];
                Base = new ushort[size];
                var next = new int[counts.Length];
                var high = size;
                for (var s = 0; s < counts.Length; s++)
                {
                    if (counts[s] == -1)  // a probability below 1 gets one cell at the end
                    {
                        Symbol[--high] = (byte)s;
                        next[s] = 1;
                    }
                    else next[s] = counts[s];
                }
                var step = (size >> 1) + (size >> 3) + 3;
                var at = 0;
                for (var s = 0; s < counts.Length; s++)
                {
                    for (var i = 0; i < counts[s]; i++)
                    {
                        Symbol[at] = (byte)s;
                        do at = at + step & size - 1;
                        while (at >= high);
                    }
                }
                if (at != 0) throw Broken("the symbols of a table do not fill it");
                for (var i = 0; i < size; i++)
                {
                    var state = next[Symbol[i]]++;
                    Bits[i] = (byte)(log - HighBit((uint)state));
                    Base[i] = (ushort)((state << Bits[i]) - size);
                }
            }

            /// <summary>A table with one symbol, for which no bits are read.</summary>
            public Fse(byte symbol)
            {
                Symbol = new[] { symbol };
                Bits = new byte[1];
                Base = new ushort[1];
            }

            /// <summary>Read a table's description at <paramref name="at"/>, and move <paramref name="at"/> behind
            /// it.</summary>
            public static Fse Read(byte[] data, ref int at, int end, int symbols, int mostLog)
            {
                var bit = 0;
                var from = at;
                Func<int, int> bits = count =>
                {
                    var value = 0;
                    for (var i = 0; i < count; i++, bit++)
                    {
                        var index = from + (bit >> 3);
                        if (index < end) value |= (data[index] >> (bit & 7) & 1) << i;
                    }
                    return value;
                };
                var log = bits(4) + 5;
                if (log > mostLog) throw Broken("a table is too large");
                var counts = new short[symbols];
                var left = (1 << log) + 1;
                var symbol = 0;
                while (left > 1)
                {
                    if (symbol >= symbols) throw Broken("a table has too many symbols");
                    var width = HighBit((uint)left) + 1;  // bits of the values 0 .. left
                    var value = bits(width - 1);
                    var small = (1 << width) - 1 - left;
                    if (value >= small)
                    {
                        value |= bits(1) << width - 1;
                        if (value >= 1 << width - 1) value -= small;
                    }
                    counts[symbol] = (short)(value - 1);
                    left -= Math.Abs(counts[symbol]);
                    if (counts[symbol++] != 0) continue;
                    int more;
                    do
                    {
                        more = bits(2);
                        symbol += more;
                    }
                    while (more == 3 && symbol < symbols);
                }
                at = from + (bit + 7 >> 3);
                if (left < 1 || at > end) throw Broken("the counts of a table do not add up");
                return new Fse(counts, log);
            }
        }

        /// <summary>A Huffman table: the next <see cref="Log"/> bits give a symbol and the length of its code.</summary>
        sealed class Huffman
        {
            public readonly int Log;
            public readonly byte[] Symbol;
            public readonly byte[] Bits;

            Huffman(byte[] weights, int count)
            {
                var total = 0;
                for (var i = 0; i < count; i++)
                {
                    if (weights[i] > 12) throw Broken("a code is too long");
                    if (weights[i] > 0) total += 1 << weights[i] - 1;
                }
                if (total == 0) throw Broken("a table has no codes");
                Log = HighBit((uint)total) + 1;
                var rest = (1 << Log) - total;
                if (Log > 11 || (rest & rest - 1) != 0) throw Broken("the lengths of codes do not add up");
                weights[count] = (byte)(HighBit((uint)rest) + 1);  // the last weight is not stored; it follows
                Symbol = new byte[1 << Log];
                Bits = new byte[1 << Log];
                var at = 0;
                for (var weight = 1; weight <= Log; weight++)
                {
                    for (var s = 0; s <= count; s++)
                    {
                        if (weights[s] != weight) continue;
                        for (var i = 0; i < 1 << weight - 1; i++, at++)
                        {
                            Symbol[at] = (byte)s;
                            Bits[at] = (byte)(Log + 1 - weight);
                        }
                    }
                }
            }

            public static Huffman Read(byte[] data, ref int at, int end)
            {
                var weights = new byte[257];
                var count = 0;
                var head = data[at++];
                if (head >= 128)
                {
                    count = head - 127;
                    for (var i = 0; i < count; i++) weights[i] = (byte)(data[at + i / 2] >> (i % 2 == 0 ? 4 : 0) & 15);
                    at += (count + 1) / 2;
                    if (at > end) throw Broken("the weights of a table are incomplete");
                    return new Huffman(weights, count);
                }
                var stop = at + head;
                if (stop > end) throw Broken("the weights of a table are incomplete");
                var table = Fse.Read(data, ref at, stop, 13, 6);
                var stream = new Backwards(data, at, stop);
                int a = stream.Read(table.Log), b = stream.Read(table.Log);
                for (;;)  // two states alternate until all bits are read
                {
                    if (count > 253) throw Broken("a table has too many weights");
                    weights[count++] = table.Symbol[a];
                    if (table.Bits[a] > stream.Left)
                    {
                        weights[count++] = table.Symbol[b];
                        break;
                    }
                    a = table.Base[a] + stream.Read(table.Bits[a]);
                    weights[count++] = table.Symbol[b];
                    if (table.Bits[b] > stream.Left)
                    {
                        weights[count++] = table.Symbol[a];
                        break;
                    }
                    b = table.Base[b] + stream.Read(table.Bits[b]);
                }
                at = stop;
                return new Huffman(weights, count);
            }

            public void Unpack(byte[] data, int start, int end, byte[] to, int at, int stop)
            {
                var stream = new Backwards(data, start, end);
                for (; at < stop; at++)
                {
                    var next = stream.Peek(Log);
                    to[at] = Symbol[next];
                    stream.Skip(Bits[next]);
                }
                if (stream.Left != 0) throw Broken("a stream has another length than stated");
            }
        }
    }
}
