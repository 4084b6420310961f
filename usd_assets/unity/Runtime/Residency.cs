// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;

namespace StereoCell
{
    /// <summary>Which items stay in memory: those that were wanted last, as many as fit. Plain data.</summary>
    public sealed class Residency<T> where T : class
    {
        readonly List<T> items = new List<T>();  // from the one that was wanted first
        readonly List<long> bytes = new List<long>();

        /// <summary>Most bytes of all items; one item stays, however large it is.</summary>
        public long Budget;

        public long Bytes { get; private set; }

        /// <summary>From the item that was wanted first to the one that was wanted last.</summary>
        public readonly IList<T> Items;

        public Residency()
        {
            Items = items.AsReadOnly();
        }

        /// <summary>Make an item the last that was wanted. Returns the items that have to leave before it is loaded.</summary>
        public List<T> Admit(T item, long itemBytes)
        {
            Remove(item);
            var leaving = new List<T>();
            while (items.Count > 0 && Bytes + itemBytes > Budget)
            {
                leaving.Add(items[0]);
                Remove(items[0]);
            }
            items.Add(item);
            bytes.Add(itemBytes);
            Bytes += itemBytes;
            return leaving;
        }

        public bool Remove(T item)
        {
            var at = items.IndexOf(item);
            if (at < 0) return false;
            Bytes -= bytes[at];
            items.RemoveAt(at);
            bytes.RemoveAt(at);
            return true;
        }
    }
}
