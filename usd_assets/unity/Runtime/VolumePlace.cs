// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.Threading.Tasks;
using UnityEngine;
using UnityEngine.Networking;

namespace StereoCell
{
    /// <summary>
    /// Finds the voxel file of a box, or makes it available. In a player the file is a streaming asset. Android keeps
    /// streaming assets inside the application's archive, so the file is first copied out. In the editor the file is made
    /// from the bundle.
    /// </summary>
    public sealed class VolumePlace : IDisposable
    {
        public const string Folder = "StereoCell";
        const string Unfinished = ".part";

        /// <summary>Set by the editor. For a box, it returns a function that makes the file and returns its path. That
        /// function may run on any thread.</summary>
        public static Func<VolumeBox, Func<string>> Maker;

        Task<string> making;
        UnityWebRequest request;
        string copying;

        VolumePlace() { }

        /// <summary>The path of the file; null while the file is not available.</summary>
        public string Path { get; private set; }

        /// <summary>The reason why there is no file; null if nothing has failed.</summary>
        public string Error { get; private set; }

        public static VolumePlace Of(VolumeBox box)
        {
            var place = new VolumePlace();
            if (Maker != null)
            {
                var make = Maker(box);
                if (Application.isPlaying) place.making = Task.Run(make);
                else place.Settle(make);
                return place;
            }
            var path = Application.streamingAssetsPath + "/" + Folder + "/" + box.file;
            if (path.Contains("://")) place.CopyOut(path, box.file);
            else place.Path = path;
            return place;
        }

        /// <summary>Check whether the file is available now. Call this on the main thread.</summary>
        public void Advance()
        {
            if (making != null && making.IsCompleted)
            {
                var done = making;
                making = null;
                Settle(() => done.GetAwaiter().GetResult());
            }
            if (request == null || !request.isDone) return;
            if (request.result == UnityWebRequest.Result.Success)
            {
                var whole = copying.Substring(0, copying.Length - Unfinished.Length);
                File.Move(copying, whole);
                Path = whole;
            }
            else Error = request.url + ": " + request.error;
            Dispose();
        }

        void Settle(Func<string> find)
        {
            try
            {
                Path = find();
            }
            catch (Exception error) when (error is IOException || error is InvalidDataException)
            {
                Error = error.Message;
            }
        }

        void CopyOut(string address, string file)
        {
            var folder = Application.temporaryCachePath + "/" + Folder;
            if (File.Exists(folder + "/" + file))
            {
                Path = folder + "/" + file;
                return;
            }
            Directory.CreateDirectory(folder);
            copying = folder + "/" + file + Unfinished;
            request = new UnityWebRequest(address, UnityWebRequest.kHttpVerbGET, new DownloadHandlerFile(copying), null);
            request.SendWebRequest();
        }

        public void Dispose()
        {
            if (request != null) request.Dispose();
            request = null;
        }
    }
}
