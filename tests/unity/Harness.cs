// Runs the package's own code with the stubs, and prints what it made as JSON.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using Newtonsoft.Json;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEditor;
using UnityEngine;

static class Harness
{
    static int Main(string[] args)
    {
        try
        {
            if (args[0] == "zstd") Unpack();
            else if (args[0] == "ktx2") Level(args[1], int.Parse(args[2]));
            else if (args[0] == "import") Console.WriteLine(JsonConvert.SerializeObject(Import(args[1], args[2], JObject.Parse(args[3]))));
            else if (args[0] == "heights") Console.WriteLine(Heights(args));
            else if (args[0] == "sort") Console.WriteLine(Sort(JArray.Parse(args[1]), JArray.Parse(args[2])));
            else if (args[0] == "tests") Console.WriteLine(Tests(float.Parse(args[1])));
            else if (args[0] == "drawer") Console.WriteLine(Drawer());
            else if (args[0] == "gaze") Console.WriteLine(Gaze(JArray.Parse(args[1])));
            else return 2;
            return 0;
        }
        catch (Exception error) when (error is BundleException || error is InvalidDataException)
        {
            Console.Error.WriteLine(error.Message);
            return 1;
        }
    }

    // frames on stdin: their bytes, the size unpacked, the frame; out: 0 and the bytes, or 1
    static void Unpack()
    {
        using (var input = new BinaryReader(Console.OpenStandardInput()))
        using (var output = new BinaryWriter(Console.OpenStandardOutput()))
        {
            var count = input.ReadInt32();
            for (var i = 0; i < count; i++)
            {
                var length = input.ReadInt32();
                var size = input.ReadInt32();
                var frame = input.ReadBytes(length);
                try
                {
                    var found = Zstd.Unpack(frame, 0, length, size);
                    output.Write((byte)0);
                    output.Write(found);
                }
                catch (InvalidDataException)
                {
                    output.Write((byte)1);
                }
            }
        }
    }

    static void Level(string path, int level)
    {
        var found = new Ktx2(File.ReadAllBytes(path), level);
        using (var output = Console.OpenStandardOutput()) output.Write(found.Texels, 0, found.Texels.Length);
    }

    static JToken Heights(string[] args)
    {
        var errors = args[1].Split(',').Select(double.Parse);
        var levels = errors.Select(error => new Level { ErrorMetres = error }).ToList();
        return new JArray(Placement.LodHeights(levels, double.Parse(args[2]), double.Parse(args[3]), double.Parse(args[4])));
    }

    // boxes [[min, max], ...] and eyes: each box's place in the order of blending, for each eye
    static JToken Sort(JArray corners, JArray eyes)
    {
        var root = new GameObject("specimen");
        var specimen = root.AddComponent<Specimen>();
        var renderers = new List<Renderer>();
        foreach (var corner in corners)
        {
            float[] min = corner[0].ToObject<float[]>(), max = corner[1].ToObject<float[]>();
            var box = new GameObject("box");
            box.transform.SetParent(root.transform, false);
            box.transform.localPosition = new Vector3(min[0], min[1], min[2]);
            var renderer = box.AddComponent<MeshRenderer>();
            renderer.sharedMaterial = new Material(null);
            renderer.sharedMaterial.SetVector("_Size", new Vector4(max[0] - min[0], max[1] - min[1], max[2] - min[2], 0));
            renderer.sharedMaterial.SetVector("_ToBox0", new Vector4(1, 0, 0, 0));
            renderer.sharedMaterial.SetVector("_ToBox1", new Vector4(0, 1, 0, 0));
            renderer.sharedMaterial.SetVector("_ToBox2", new Vector4(0, 0, 1, 0));
            box.AddComponent<VolumeBox>();
            renderers.Add(renderer);
        }
        var found = new JArray();
        foreach (var eye in eyes)
        {
            specimen.SortFrom(new Vector3((float)eye[0], (float)eye[1], (float)eye[2]));
            found.Add(new JArray(renderers.Select(renderer => renderer.sortingOrder)));
        }
        return found;
    }

    // the package's own tests, as Unity's test runner would run them
    static JToken Tests(float mirrorX)
    {
        AssetDatabase.MirrorX = mirrorX;
        var found = new JObject();
        foreach (var method in typeof(StereoCell.Tests.InEditorTests).GetMethods().Where(m => m.IsDefined(typeof(NUnit.Framework.TestAttribute), false)))
        {
            try
            {
                method.Invoke(new StereoCell.Tests.InEditorTests(), null);
                found[method.Name] = "passed";
            }
            catch (TargetInvocationException error) when (error.InnerException is NUnit.Framework.AssertionException || error.InnerException is NUnit.Framework.IgnoreException)
            {
                found[method.Name] = error.InnerException.Message;
            }
        }
        return found;
    }

    // what the Inspector draws of a channel, each thing clicked on
    static JToken Drawer()
    {
        var channel = new Channel { name = "CD31", functions = new[] { "default", "sharp" } };
        new ChannelDrawer().OnGUI(new Rect { width = 100 }, new SerializedProperty(channel), GUIContent.none);
        return new JObject(new JProperty("drawn", new JArray(EditorGUI.Drawn)), new JProperty("visible", channel.isVisible), new JProperty("function", channel.function));
    }

    static JToken Import(string folder, string target, JObject how)
    {
        AssetDatabase.HasGltf = how["gltf"] == null || (bool)how["gltf"];
        var options = how["mostTexels"] == null ? null : new ImportOptions { mostTexels = (int)how["mostTexels"] };
        if (how["camera"] != null) Camera.main = new GameObject("camera").AddComponent<Camera>();
        var root = BundleImporter.Import(folder, target, options);
        var specimen = root.GetComponent<Specimen>();
        foreach (var call in how["calls"] ?? new JArray())
        {
            var method = (string)call["name"];
            if (method == "SortFrom")
            {
                specimen.SortFrom(new Vector3((float)call["args"][0], (float)call["args"][1], (float)call["args"][2]));
                continue;
            }
            if (method == "endsAtSurfaces")
            {
                specimen.endsAtSurfaces = true;
                specimen.Apply();
                continue;
            }
            try
            {
                var args = call["args"].Select(Argument).ToArray();
                typeof(Specimen).GetMethod(method).Invoke(specimen, args);
            }
            catch (TargetInvocationException error) when (error.InnerException is ArgumentException)
            {
                return error.InnerException.Message;
            }
        }
        return new JObject(
            new JProperty("root", Dump(root)),
            new JProperty("saved", new JArray(PrefabUtility.Saved)),
            new JProperty("assets", new JArray(AssetDatabase.Assets.Keys)),
            new JProperty("bars", EditorUtility.ShownBars),
            new JProperty("depth", ReferenceEquals(Camera.main, null) ? "" : Camera.main.depthTextureMode.ToString()),
            new JProperty("channels", JToken.FromObject(specimen.channels.Select(c => new { c.id, c.name, c.isVisible, c.function, c.functions, c.firstRow, surfaces = c.surfaces.Count }))),
            new JProperty("table", Dump(specimen.table)));
    }

    static object Argument(JToken value)
    {
        if (value is JArray) return new Color((float)value[0], (float)value[1], (float)value[2], 1);
        return value.Type == JTokenType.Boolean ? (object)(bool)value : (string)value;
    }

    static JToken Dump(GameObject made)
    {
        var at = made.transform;
        var dump = new JObject(
            new JProperty("name", made.name),
            new JProperty("active", made.activeSelf),
            new JProperty("position", Dump(at.position)),
            new JProperty("scale", Dump(at.localScale)));
        var tile = made.GetComponent<Tile>();
        if (!ReferenceEquals(tile, null)) dump["tile"] = tile.ShowsVolume;
        var collider = made.GetComponent<BoxCollider>();
        if (!ReferenceEquals(collider, null)) dump["collider"] = Dump(collider.size);
        var group = made.GetComponent<LODGroup>();
        if (!ReferenceEquals(group, null))
        {
            dump["lods"] = new JArray(group.Lods.Select(lod => new JArray(lod.screenRelativeTransitionHeight, lod.renderers.Length)));
            dump["size"] = group.size;
        }
        var mesh = made.GetComponent<MeshFilter>();
        if (!ReferenceEquals(mesh, null))
        {
            dump["vertices"] = new JArray(mesh.sharedMesh.vertices.Select(v => Dump(v)));
            dump["world"] = new JArray(mesh.sharedMesh.vertices.Select(v => Dump(at.TransformPoint(v))));
            if (mesh.sharedMesh.triangles != null) dump["triangles"] = new JArray(mesh.sharedMesh.triangles);
        }
        var renderer = made.GetComponent<Renderer>();
        if (!ReferenceEquals(renderer, null))
        {
            dump["enabled"] = renderer.enabled;
            dump["order"] = renderer.sortingOrder;
            if (renderer.Block != null) dump["block"] = Dump(renderer.Block);
            if (!ReferenceEquals(renderer.sharedMaterial, null))
            {
                dump["material"] = Dump(renderer.sharedMaterial.Values);
                dump["keywords"] = new JArray(renderer.sharedMaterial.Keywords);
            }
        }
        var box = made.GetComponent<VolumeBox>();
        if (!ReferenceEquals(box, null)) dump["channels"] = new JArray(box.channels);
        if (at.childCount > 0) dump["children"] = new JArray(Enumerable.Range(0, at.childCount).Select(i => Dump(at.GetChild(i).gameObject)));
        return dump;
    }

    static JToken Dump(IDictionary<string, object> values)
    {
        return new JObject(values.Select(pair => new JProperty(pair.Key, Dump(pair.Value))));
    }

    static JToken Dump(object value)
    {
        if (value is Vector3) return new JArray(((Vector3)value).x, ((Vector3)value).y, ((Vector3)value).z);
        if (value is Vector4) return new JArray(((Vector4)value).x, ((Vector4)value).y, ((Vector4)value).z, ((Vector4)value).w);
        if (value is Color) return new JArray(((Color)value).r, ((Color)value).g, ((Color)value).b, ((Color)value).a);
        if (value is Vector4[]) return new JArray(((Vector4[])value).Select(v => Dump(v)));
        var texture = value as Texture;
        if (ReferenceEquals(texture, null)) return new JValue(value);
        var depth = texture is Texture3D ? ((Texture3D)texture).depth : 1;
        return new JObject(
            new JProperty("size", new JArray(texture.width, texture.height, depth)),
            new JProperty("format", texture.Format),
            new JProperty("wrap", texture.wrapMode.ToString()),
            new JProperty("linear", !(texture is Texture2D) || ((Texture2D)texture).IsLinear),
            new JProperty("texels", Convert.ToBase64String((byte[])texture.Data)));
    }

    // [[target or null, seconds], ...]: whether each frame switches the tile, and the ring's progress
    static JToken Gaze(JArray frames)
    {
        Camera.main = new GameObject("camera").AddComponent<Camera>();
        var gaze = new GameObject("specimen").AddComponent<GazeSwitch>();
        var tiles = new Dictionary<string, BoxCollider>();
        var update = typeof(GazeSwitch).GetMethod("Update", BindingFlags.Instance | BindingFlags.NonPublic);
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
            update.Invoke(gaze, null);
            found.Add(new JArray(gaze.Progress, new JArray(tiles.Where(t => t.Value.GetComponent<Tile>().ShowsVolume).Select(t => t.Key))));
        }
        return found;
    }
}
