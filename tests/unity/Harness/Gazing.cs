// Runs frames of a player: gaze, loading, the reticle and the button.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Threading;
using Google.XR.Cardboard;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Samples;
using StereoCell.Samples.Editor;
using UnityEngine;
using UnityEngine.Rendering;

static class Gazing
{
    /// <summary>Run frames [[target or null, seconds], ...]. Returns for each frame the ring's progress, and the tiles that
    /// show their volume.</summary>
    public static JToken Gaze(JArray frames)
    {
        Camera.main = new GameObject("camera").AddComponent<Camera>();
        var gaze = new GameObject("specimen").AddComponent<GazeSwitch>();
        var tiles = new Dictionary<string, BoxCollider>();
        var found = new JArray();
        foreach (var frame in frames)
        {
            var name = (string)frame[0];
            if (name != null && !tiles.ContainsKey(name))
            {
                var tile = new GameObject(name).AddComponent<Tile>();
                tile.surfaces = new GameObject("surfaces");
                tile.volume = new GameObject("volume");
                tile.Show(true, false);
                tiles.Add(name, tile.gameObject.AddComponent<BoxCollider>());
            }
            Physics.Ahead = name == null ? null : tiles[name];
            Time.unscaledDeltaTime = (float)frame[1];
            Program.Send(gaze, "Update");
            found.Add(new JArray(gaze.Progress, new JArray(tiles.Where(t => t.Value.GetComponent<Tile>().ShowsVolume).Select(t => t.Key))));
        }
        return found;
    }

    /// <summary>
    /// Look at each tile of a specimen until it shows its volume. The arguments state sizes and budget. Each channel of a
    /// tile has one value in all voxels. Returns the visible tiles after each step, the peak memory of textures, the largest
    /// upload of one frame, and whether a texture that the GPU has lost is loaded again.
    /// </summary>
    public static JToken Tour(JObject asked)
    {
        int[] size = asked["size"].ToObject<int[]>();
        int channels = (int)asked["channels"], count = (int)asked["tiles"];
        SystemInfo.copyTextureSupport = (bool)asked["slices"] ? (CopyTextureSupport)31 : CopyTextureSupport.Basic;
        VolumePlace.Maker = null;
        Application.isPlaying = true;
        Application.streamingAssetsPath = "streaming";
        Directory.CreateDirectory("streaming/StereoCell");
        var specimen = MakeSpecimen(size, channels, count, (float)asked["budget"]);
        var gaze = specimen.gameObject.AddComponent<GazeSwitch>();
        Camera.main = new GameObject("camera").AddComponent<Camera>();
        Program.Send(specimen, "OnEnable");
        Time.unscaledDeltaTime = 1 / 64f;
        var tiles = specimen.GetComponentsInChildren<Tile>(true);
        var steps = new JArray();
        foreach (var tile in tiles)
        {
            Physics.Ahead = tile.GetComponent<Collider>();
            int frames = 0, wasSurface = 0;
            long mostInFrame = 0;
            while (!tile.ShowsVolume && frames++ < 100000)
            {
                Program.Send(gaze, "Update");
                var before = Graphics.CopiedBytes;
                Program.Send(specimen, "Update");
                mostInFrame = Math.Max(mostInFrame, Graphics.CopiedBytes - before);
                if (tile.IsLoading && tile.surfaces.activeSelf) wasSurface++;
                Thread.Sleep(1);
            }
            steps.Add(new JObject(
                new JProperty("showing", new JArray(tiles.Where(each => each.ShowsVolume).Select(each => each.name))),
                new JProperty("surfaces", new JArray(tiles.Where(each => each.surfaces.activeSelf).Select(each => each.name))),
                new JProperty("loading", wasSurface > 0),
                new JProperty("resident", specimen.VolumeBytes),
                new JProperty("held", Texture.HeldBytes),
                new JProperty("mostInFrame", mostInFrame)));
        }
        var last = TextureOf(tiles.Last());
        var reloaded = false;
        if (last is RenderTexture)
        {
            ((RenderTexture)last).Release();  // a phone's GPU may do this while the program is in the background
            for (var frame = 0; frame < 100000 && !reloaded; frame++)
            {
                Program.Send(specimen, "Update");
                var now = TextureOf(tiles.Last());
                reloaded = now != null && !ReferenceEquals(now, last);
                Thread.Sleep(1);
            }
            last = TextureOf(tiles.Last());
        }
        return new JObject(
            new JProperty("steps", steps),
            new JProperty("peak", tiles[0].PeakBytes),
            new JProperty("most", Texture.MostBytes),
            new JProperty("errors", new JArray(Debug.Errors)),
            new JProperty("reloaded", reloaded),
            new JProperty("sums", new JArray(Enumerable.Range(0, VolumeFile.ComponentsOf(channels)).Select(c => SumOf(last.Data, c, VolumeFile.ComponentsOf(channels))))));
    }

    static Texture TextureOf(Tile tile)
    {
        return (Texture)tile.GetComponentsInChildren<Renderer>(true)[0].sharedMaterial.Values["_Volume"];
    }

    static long SumOf(byte[] texels, int component, int stride)
    {
        long sum = 0;
        for (var i = component; i < texels.Length; i += stride) sum += texels[i];
        return sum;
    }

    static Specimen MakeSpecimen(int[] size, int channels, int count, float budget)
    {
        var root = new GameObject("specimen");
        var specimen = root.AddComponent<Specimen>();
        specimen.budget = budget;
        for (var c = 0; c < channels; c++) specimen.channels.Add(new Channel { id = "c" + c, functions = new[] { "default" } });
        for (var t = 0; t < count; t++)
        {
            var tile = new GameObject("tile" + t).AddComponent<Tile>();
            tile.transform.SetParent(root.transform, false);
            tile.gameObject.AddComponent<BoxCollider>();
            tile.surfaces = new GameObject("surfaces");
            tile.volume = new GameObject("volume");
            tile.surfaces.transform.SetParent(tile.transform, false);
            tile.volume.transform.SetParent(tile.transform, false);
            tile.volume.SetActive(false);
            var box = new GameObject("box").AddComponent<VolumeBox>();
            box.transform.SetParent(tile.volume.transform, false);
            box.GetComponent<Renderer>().sharedMaterial = new Material((Shader)null);
            box.channels = Enumerable.Range(0, channels).ToArray();
            box.size = size;
            box.file = "tile" + t + ".volume";
            var volumes = Enumerable.Range(0, channels).Select(c => Enumerable.Repeat((byte)(t + 1 + c), size[0] * size[1] * size[2]).ToArray()).ToArray();
            using (var file = File.Create("streaming/StereoCell/" + box.file)) VolumeFile.Write(file, size[0], size[1], size[2], volumes);
        }
        return specimen;
    }

    /// <summary>Run the sample's scene around an imported bundle. The reticle fills, the tile switches, and the button
    /// switches it back.</summary>
    public static JToken Sample(string folder)
    {
        SystemInfo.copyTextureSupport = (CopyTextureSupport)31;
        var made = Importing.Link(folder);
        foreach (var each in made.GetComponentsInChildren<Tile>(true)) each.volume.SetActive(false);
        var reticle = CardboardScene.Build(new[] { made });
        Application.isPlaying = true;
        var specimen = made.GetComponent<Specimen>();
        var button = made.GetComponent<CardboardButton>();
        Program.Send(specimen, "OnEnable");
        Program.Send(reticle, "Awake");
        Program.Send(button, "Start");
        var tile = made.GetComponentsInChildren<Tile>(true)[0];
        Physics.Ahead = tile.GetComponent<Collider>();
        Time.unscaledDeltaTime = 1 / 64f;
        var filled = new JArray();
        for (var frame = 0; frame <= 96; frame++) Frame(specimen, button, reticle, filled);
        for (var wait = 0; wait < 2000 && !tile.ShowsVolume; wait++)
        {
            Thread.Sleep(1);
            Frame(specimen, button, reticle, new JArray());
        }
        var afterDwell = tile.ShowsVolume;
        Api.IsTriggerPressed = true;
        Frame(specimen, button, reticle, new JArray());
        Api.IsTriggerPressed = false;
        var afterButton = tile.ShowsVolume;
        for (var frame = 0; frame < 200; frame++) Frame(specimen, button, reticle, new JArray());
        return new JObject(
            new JProperty("filled", filled),
            new JProperty("afterDwell", afterDwell),
            new JProperty("afterButton", afterButton),
            new JProperty("afterRest", tile.ShowsVolume),
            new JProperty("scans", Api.Scans),
            new JProperty("steps", specimen.steps),
            new JProperty("camera", made.GetComponent<GazeSwitch>().viewer.gameObject.tag));
    }

    static void Frame(Specimen specimen, CardboardButton button, Reticle reticle, JArray filled)
    {
        Program.Send(specimen.GetComponent<GazeSwitch>(), "Update");
        Program.Send(button, "Update");
        Program.Send(specimen, "Update");
        Program.Send(reticle, "LateUpdate");
        filled.Add(reticle.Filled);
    }
}
