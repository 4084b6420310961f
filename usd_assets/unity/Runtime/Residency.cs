// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;

namespace StereoCell
{
    /// <summary>Decides which items stay in memory: the most recently requested ones, as many as fit. Plain
    /// data.</summary>
    public sealed class Residency<T> where T : class
    {
        readonly List<T> items = new List<T>();  // least recently requested first
        readonly List<long> bytes = new List<long>();

        /// <summary>Bytes. Limit for all items together. The newest item stays even if it alone is larger.</summary>
        public long Budget;

        public long Bytes { get; private set; }

        /// <summary>The items, least recently requested first.</summary>
        public readonly IList<T> Items;

        public Residency()
        {
            Items = items.AsReadOnly();
        }

        /// <summary>Make an item the most recently requested one. Returns the items to unload before it is
        /// loaded.</summary>
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
