// Imports bundles through the stub of Unity's asset database.
using System;
using System.IO;
using System.Linq;
using System.Reflection;
using Newtonsoft.Json.Linq;
using StereoCell;
using StereoCell.Editor;
using UnityEditor;
using UnityEditor.Build;
using UnityEngine;

static class Importing
{
    const string Asset = "Assets/Mine.stereocell";

    /// <summary>Link or copy a bundle into the project. An error of the import becomes an exception.</summary>
    public static GameObject Link(string folder, bool isCopy = false)
    {
        try
        {
            return isCopy ? BundleMenu.Copy(folder, Asset) : BundleMenu.Link(folder, Asset);
        }
        catch (BundleException error) when (error.Message.Contains("The console shows the reason"))
        {
            throw new BundleException(string.Join("\n", AssetDatabase.ContextOf(Asset).Errors));
        }
    }

    /// <summary>Import an asset that is already in the project. Returns the errors.</summary>
    public static JToken Asked(string asset)
    {
        AssetDatabase.ImportAsset(asset);
        return new JArray(AssetDatabase.ContextOf(asset).Errors);
    }

    public static JToken Import(string folder, JObject how)
    {
        GLTFast.GltfImport.IsThere = how["gltf"] == null || (bool)how["gltf"];
        if (how["slices"] != null) SystemInfo.copyTextureSupport = (UnityEngine.Rendering.CopyTextureSupport)31;
        if (how["camera"] != null) Camera.main = new GameObject("camera").AddComponent<Camera>();
        var root = Link(folder, how["copy"] != null);
        if (how["mostTexels"] != null)
        {
            var importer = (SpecimenImporter)AssetImporter.GetAtPath(Asset);
            importer.options.mostTexels = (int)how["mostTexels"];
            importer.SaveAndReimport();
            root = AssetDatabase.LoadAssetAtPath<GameObject>(Asset);
        }
        var specimen = root.GetComponent<Specimen>();
        Application.isPlaying = how["play"] != null;
        if (Application.isPlaying) specimen.Apply();
        foreach (var call in how["calls"] ?? new JArray())
        {
            var refusal = Call(specimen, (string)call["name"], (JArray)call["args"]);
            if (refusal != null) return refusal;
        }
        Application.isPlaying = false;
        foreach (var box in root.GetComponentsInChildren<VolumeBox>(true)) box.Advance(long.MaxValue);
        if (Debug.Errors.Count > 0) throw new BundleException(string.Join("\n", Debug.Errors));
        return new JObject(
            new JProperty("root", Dumping.Dump(root)),
            new JProperty("objects", new JArray(AssetDatabase.ContextOf(Asset).Objects.Keys)),
            new JProperty("warnings", new JArray(AssetDatabase.ContextOf(Asset).Warnings)),
            new JProperty("sources", new JArray(AssetDatabase.ContextOf(Asset).SourceDependencies)),
            new JProperty("depth", ReferenceEquals(Camera.main, null) ? "" : Camera.main.depthTextureMode.ToString()),
            new JProperty("channels", JToken.FromObject(specimen.channels.Select(c => new { c.id, c.name, c.isVisible, c.function, c.functions, c.firstRow, surfaces = c.surfaces.Count }))),
            new JProperty("table", Dumping.Dump(specimen.table)));
    }

    /// <summary>Call a method of the specimen. Returns the error message if the call is refused, else null.</summary>
    static string Call(Specimen specimen, string method, JArray args)
    {
        if (method == "SortFrom") specimen.SortFrom(new Vector3((float)args[0], (float)args[1], (float)args[2]));
        else if (method == "endsAtSurfaces")
        {
            specimen.endsAtSurfaces = true;
            specimen.Apply();
        }
        else
        {
            try
            {
                typeof(Specimen).GetMethod(method).Invoke(specimen, args.Select(Argument).ToArray());
            }
            catch (TargetInvocationException error) when (error.InnerException is ArgumentException)
            {
                return error.InnerException.Message;
            }
        }
        return null;
    }

    static object Argument(JToken value)
    {
        if (value is JArray) return new Color((float)value[0], (float)value[1], (float)value[2], 1);
        return value.Type == JTokenType.Boolean ? (object)(bool)value : (string)value;
    }

    /// <summary>
    /// Link or copy a bundle, and give a channel one of the project's materials. Then come back to the editor three times:
    /// with the same bundle, with a rebuilt one, and with a damaged one. Returns the state of the import after each step.
    /// </summary>
    public static JToken Changes(string folder, string other, string how)
    {
        CopyFolder(folder, "linked");
        var isCopy = how == "copy";
        Link("linked", isCopy);
        var own = new Material((Shader)null) { name = "my own" };
        AssetImporter.GetAtPath(Asset).AddRemap(SpecimenImporter.MaterialOf("CD31"), own);
        AssetImporter.GetAtPath(Asset).SaveAndReimport();
        ComeBack();
        var days = new JArray(Day());
        AssetDatabase.Log.Clear();
        ComeBack();
        days.Add(Day());
        Directory.Delete("linked", true);
        CopyFolder(other, "linked");
        if (isCopy)
        {
            File.Delete(Asset);
            System.IO.Compression.ZipFile.CreateFromDirectory("linked", Asset);
        }
        ComeBack();
        days.Add(Day());
        File.WriteAllText("linked/manifest.json", "{");
        if (isCopy) File.WriteAllText(Asset, "{");
        ComeBack();
        days.Add(Day());
        return days;
    }

    /// <summary>Bring the editor to the front. Unity then checks the project's files, and the package its bundles.</summary>
    static void ComeBack()
    {
        AssetDatabase.Refresh();
        EditorApplication.Focus();
    }

    static JObject Day()
    {
        var context = AssetDatabase.ContextOf(Asset);
        var root = AssetDatabase.LoadAssetAtPath<GameObject>(Asset);
        var day = new JObject(
            new JProperty("imports", AssetDatabase.Log.Count),
            new JProperty("objects", new JArray(context.Objects.Keys)),
            new JProperty("errors", new JArray(context.Errors)),
            new JProperty("files", new JArray(Directory.GetFiles("Assets", "*", SearchOption.AllDirectories))));
        AssetDatabase.Log.Clear();
        if (root == null) return day;
        day["color"] = Dumping.Dump(root.GetComponent<Specimen>().channels[0].color);
        day["paths"] = new JArray(root.GetComponentsInChildren<Transform>(true).Select(PathOf));
        day["materials"] = new JArray(root.GetComponent<Specimen>().Find("CD31").surfaces
            .SelectMany(surface => surface.GetComponentsInChildren<Renderer>(true)).Select(renderer => renderer.sharedMaterial.name).Distinct());
        return day;
    }

    static string PathOf(Transform at)
    {
        return at.parent == null ? "" : PathOf(at.parent) + "/" + at.name;
    }

    static void CopyFolder(string from, string to)
    {
        foreach (var file in Directory.GetFiles(from, "*", SearchOption.AllDirectories))
        {
            var target = Path.Combine(to, file.Substring(from.Length + 1));
            Directory.CreateDirectory(Path.GetDirectoryName(target));
            File.Copy(file, target);
        }
    }

    /// <summary>Run the package's own tests as Unity's test runner would.</summary>
    public static JToken Tests(float mirrorX)
    {
        GLTFast.GltfImport.MirrorX = mirrorX;
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

    /// <summary>Build a player for each of two scenes; only the first has the specimen. Returns the streaming
    /// assets.</summary>
    public static JToken Build(string folder)
    {
        Link(folder);
        AssetDatabase.Dependencies["Assets/a.unity"] = new[] { "Assets/a.unity", Asset };
        var found = new JObject();
        foreach (var scene in new[] { "Assets/a.unity", "Assets/b.unity" })
        {
            var context = new BuildPlayerContext { BuildPlayerOptions = new BuildPlayerOptions { scenes = new[] { scene } } };
            new VolumesOfBuild().PrepareForBuild(context);
            found[scene] = new JArray(context.Added);
        }
        found["boxes"] = new JArray(AssetDatabase.LoadAssetAtPath<GameObject>(Asset).GetComponentsInChildren<VolumeBox>(true).Select(box => box.file));
        return found;
    }
}
