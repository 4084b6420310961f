// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Concurrent;
using System.IO;
using System.Threading;
using System.Threading.Tasks;
using UnityEngine;

namespace StereoCell
{
    /// <summary>
    /// Loads the volume of one box into a texture. A separate thread reads slices, a few ahead of the upload. The main
    /// thread uploads some slices in each frame, so that no frame waits for the disk or for a whole volume.
    /// </summary>
    public sealed class VolumeLoad
    {
        readonly VolumeBox box;
        readonly CancellationTokenSource cancel = new CancellationTokenSource();
        readonly ConcurrentQueue<byte[]> ready = new ConcurrentQueue<byte[]>();
        readonly BlockingCollection<byte[]> free = new BlockingCollection<byte[]>();
        VolumePlace place;
        Task reading;
        int uploaded;

        public VolumeLoad(VolumeBox box)
        {
            this.box = box;
            place = VolumePlace.Of(box);
        }

        public VolumeTexture Texture { get; private set; }

        /// <summary>The reason why the volume can't be shown; null if nothing has failed.</summary>
        public string Error { get; private set; }

        public bool IsDone
        {
            get { return uploaded == box.size[2]; }
        }

        /// <summary>0 to 1. The share of the slices that is uploaded.</summary>
        public float Progress
        {
            get { return (float)uploaded / box.size[2]; }
        }

        /// <summary>Upload slices that were read, until mostBytes are reached. Call this on the main thread.</summary>
        public void Advance(long mostBytes)
        {
            if (IsDone || Error != null) return;
            if (reading == null && !Begin()) return;
            byte[] slice;
            for (long bytes = 0; bytes < mostBytes && ready.TryDequeue(out slice); bytes += slice.Length)
            {
                Texture.Upload(uploaded++, slice);
                free.Add(slice);
            }
            if (IsDone) Texture.Finish();
            else if (reading.IsFaulted) Fail(reading.Exception.GetBaseException().Message);
        }

        /// <summary>Load the whole volume now. Outside of play mode there are no frames to spread the work over.</summary>
        public void Finish()
        {
            while (!IsDone && Error == null)
            {
                Advance(long.MaxValue);
                Thread.Sleep(0);
            }
        }

        /// <summary>Stop reading, and destroy the texture unless it is complete.</summary>
        public void Stop()
        {
            cancel.Cancel();
            if (place != null) place.Dispose();
            if (Texture != null && !IsDone) Texture.Destroy();
        }

        bool Begin()
        {
            place.Advance();
            if (place.Error != null) Fail(place.Error);
            if (place.Path == null) return false;
            var path = place.Path;
            place = null;
            Texture = new VolumeTexture(box.size, box.channels.Length);
            var bytes = box.size[0] * box.size[1] * VolumeFile.ComponentsOf(box.channels.Length);
            for (var i = 0; i < VolumeMemory.SlicesAhead; i++) free.Add(new byte[bytes]);
            reading = Task.Run(() => Read(path));
            return true;
        }

        void Read(string path)
        {
            using (var file = new VolumeFile(File.OpenRead(path)))
            {
                if (file.Width != box.size[0] || file.Height != box.size[1] || file.Depth != box.size[2] || file.Channels != box.channels.Length)
                {
                    throw new InvalidDataException(path + ": size differs from that of the box. Import the bundle again.");
                }
                for (var i = 0; i < file.Depth; i++)
                {
                    var slice = free.Take(cancel.Token);
                    file.ReadSlice(slice);
                    ready.Enqueue(slice);
                }
            }
        }

        void Fail(string error)
        {
            Error = error;
            Stop();
            Texture = null;
        }
    }
}
