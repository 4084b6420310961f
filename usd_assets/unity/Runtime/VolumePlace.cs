// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.Threading.Tasks;
using UnityEngine;
using UnityEngine.Networking;

namespace StereoCell
{
    /// <summary>
    /// Where a volume's file lies, once it is there. In a player it is a streaming asset; Android keeps those inside
    /// the application's archive, so it is copied out first. In the editor it is made of the bundle.
    /// </summary>
    public sealed class VolumePlace : IDisposable
    {
        public const string Folder = "StereoCell";
        const string Unfinished = ".part";

        /// <summary>Set by the editor: returns the function that makes the file of a box, on any thread, and returns
        /// its path.</summary>
        public static Func<VolumeBox, Func<string>> Maker;

        Task<string> making;
        UnityWebRequest request;
        string copying;

        VolumePlace() { }

        /// <summary>The path; null while the file is not there.</summary>
        public string Path { get; private set; }

        /// <summary>Why there is no file; null while there is hope.</summary>
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

        /// <summary>Look whether the file has come. Call it on the main thread.</summary>
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
